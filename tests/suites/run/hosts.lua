--- hosts.lua: a run on three hosts of a network, each with its own home and clock: its bytes, and
--- how it ends where a host or the network fails. tests/support/hosts.sh makes the hosts.

local host = require "limax.host"
local process = require "support.process"
local source = require "limax.base.source"
local whole_runs = require "support.whole_runs"

local suite = require("limax.test").suite "hosts"

-- Its fitness waits in the generations after the one that the file `last` names.
local WAIT = [[
local function waits(generation)
  local file = io.open "FOLDER/last"
  local last = file and file:read "*n"
  if file then file:close() end
  if not last or generation <= last then return false end
  require("limax.host").wait(0.1)
  return true
end
]]

-- `begin N COMMAND...` starts a run and returns once generation N is on disk, after which the run
-- waits; `ended` waits until it fails.
local FUNCTIONS = [[
lines() { on 1 cat "$run/journal.jsonl" 2>/dev/null | grep -c '"kind":"generation"' || :; }
begin() {
  local last=$1
  shift
  echo $last >"$folder/last"
  "$@" &
  job=$!
  until [ "$(lines)" -gt $last ]; do kill -0 $job; sleep 0.05; done
}
ended() {
  local status=0
  (sleep 300; echo "it does not end"; kill $job) & watch=$!
  wait $job || status=$?
  kill $watch
  rm "$folder/last"
  [ $status -ne 0 ]
}
for k in 1 2 3 4; do mkdir -p "$folder/$k/home" && cp "$folder/walk.lua" "$folder/$k/home"; done
run=$folder/1/home/run
]]

-- Host 2 writes a folder of all hosts and is lost or cut off; the others may go on only then.
local SHARED = [[
boot 1; boot 2 +1h; boot 3 -1h
%s
begin 3 on 2 "$limax" run walk.lua -q --out $run
for k in 1 3; do
  cp -r $folder/2/home/.config $folder/$k/home # with the key that sealed it
  on $k "$limax" run --resume $run -q && echo "host $k: not refused"
done
%s 2
rm $folder/last
for k in {1..100}; do ! on 3 "$limax" run --resume $run -q || break; sleep 1; done
on 1 cp -r $run $folder/1/home/run
]]

-- Tasks of an array, and a run on several ranks with the job script of CLUSTER.md.
local SLURM = [[
. "$(dirname "$0")/slurm.sh"
slurm
cd "$folder"
mkdir bin
ln -s "$limax" bin/limax
echo 3 >last
array() { on 1 env -C "$folder" "$limax" sweep "$@" --threads 1 --slurm >array.sh; }
array walk.lua --set seed=1,2 --out rates
for k in 2 3; do cp -r 1/home/.config $k/home; done # with the key that sealed it
page="$(dirname "$0")/../../scripts/CLUSTER.md"
(echo "#!/bin/sh"; sed -n '/^#SBATCH --nodes/,/^exec mpirun/p' "$page") >first.sh
sed 's/mpirun --bind-to none/srun --mpi=pmix/; s/run walk.lua --out/run --resume/' first.sh >next.sh
options="--nodes=2 --ntasks-per-node=2 --cpus-per-task=1 --time=2"
job=$(batch array.sh --time=2)
batch first.sh $options
until [ -s rates/seed=2/r01/r01/metrics.jsonl ]; do sleep 0.5; done
on 1 scontrol requeue ${job}_2
jobs_end # at their time limits
on 1 scontrol show job | grep -E "JobState|ExitCode|RunTime"
rm last
array --resume rates
batch array.sh --time=9
batch next.sh $options
jobs_end
cat slurm-*.out rates/slurm-*.log
for k in 1 2; do
  grep -c '"kind":"begin"' rates/seed=$k/r01/journal.jsonl
  grep -o '"state":"[a-z]*"' rates/seed=$k/r01/journal.jsonl
done
for name in metrics ledger; do cmp rates/seed=1/r01/r01/$name.jsonl runs/walk/r01/$name.jsonl; done
cp -r runs/walk 1/home/run
]]

local REFUSED = "is in use by another process.*is in use by another process"
local RESUMES = "continue with: mpirun %-n 3 [^\n]* %-%-resume run\n"

-- Name, what happens, and a pattern of what is printed. `long`: only LIMAX_TESTS=full runs it.
local CASES = {
  { "clocks an hour apart change nothing", [[
    boot 1 +1h; boot 2; boot 3 -1h
    ranks 1 2 3 run walk.lua -q --out run
    ranks 1 2 run --resume run --from 5 -q
  ]], "" },
  { "a run that loses a host ends, and goes on with others", [[
    boot 1; boot 2; boot 3
    begin 3 ranks 1 2 3 run walk.lua -q --out run
    lose 3
    ended
    boot 4
    begin 6 ranks 1 2 4 2 run --resume run -q
    kill -KILL ${first[2]} # its kernel closes the connections: MPI may be first to end all
    ended
    ranks 1 4 run --resume run -q
  ]], RESUMES },
  { "a network that stops for 30 s ends the run, which goes on", [[
    boot 1; boot 2; boot 3
    begin 3 ranks 1 2 3 run walk.lua -q --out run
    cut 3
    sleep 30
    join 3
    ended
    ranks 1 2 3 run --resume run -q
  ]], RESUMES, long = true },
  { "hosts lock a run that all see", SHARED:format("run=$folder/run", "lose"), REFUSED },
  { "hosts lock a run on NFS, until the lease of one that is cut off ends",
    SHARED:format("share; run=/mnt/run", "cut"), REFUSED, long = true },
  { "hosts write their robots into files on NFS", [[
    boot 1; boot 2; boot 3
    share
    ranks 1 2 3 run walk.lua -q --out /mnt/run
    on 1 "$limax" list --check /mnt/run
    on 1 cp -r /mnt/run $run
    for k in 3 2 1; do on $k umount /mnt; done
  ]], "undamaged", long = true },
  { "jobs of Slurm end at their time limits, and go on", SLURM, "", long = true },
}

for _, case in ipairs(CASES) do
  suite:test(case[1], function(t)
    if case.long and os.getenv "LIMAX_TESTS" ~= "full" then t:skip "LIMAX_TESTS=full runs it" end
    local folder = t:folder()
    process.write(folder .. "/walk.lua", WAIT:gsub("FOLDER", folder)
      .. whole_runs.experiment(12, 1):gsub("fitness = function[^\n]*",
        "%0 while waits(robot.generation) do end"))
    process.write(folder .. "/case.sh", FUNCTIONS .. case[2])
    local script = host.file.absolute(source.folder_of(debug.getinfo(1, "S").source:sub(2))
      .. "/../../support/hosts.sh")
    local output = process.output(("limax=%s bash %s %s '. \"$folder/case.sh\"' 2>&1; echo end $?")
      :format(process.quote(host.executable), process.quote(script), process.quote(folder)))
    local reason = output:match "skipped: ([^\n]*)"
    if reason then t:skip(reason) end
    t:ok(output:find "end 0\n$" and output:find(case[3]), output)
    process.completes(t, folder, { "run", "walk.lua", "-q", "--out", "whole" })
    whole_runs.same(t, folder .. "/1/home/run", folder .. "/whole")
  end)
end
