--- hosts.lua: a run on three hosts of a network, each with its own home and clock: its bytes, and
--- how it ends where a host or the network fails. tests/support/hosts.sh makes the hosts.

local host = require "limax.host"
local process = require "support.process"
local source = require "limax.base.source"
local whole_runs = require "support.whole_runs"

local suite = require("limax.test").suite "hosts"

local GENERATIONS = 24

-- `begin N COMMAND...` starts a run and returns once it has written N generations more; `ended`
-- waits until it fails.
local FUNCTIONS = [[
lines() { on 1 cat "$run/journal.jsonl" 2>/dev/null | grep -c '"kind":"generation"' || :; }
begin() {
  local last=$(($(lines) + $1))
  shift
  "$@" &
  job=$!
  until [ "$(lines)" -ge $last ]; do kill -0 $job; sleep 0.05; done
}
ended() {
  local status=0
  (sleep 300; echo "it does not end"; kill $job) & watch=$!
  wait $job || status=$?
  kill $watch
  [ $status -ne 0 ]
}
for k in 1 2 3 4; do mkdir -p "$folder/$k/home" && cp "$folder/tiny.lua" "$folder/$k/home"; done
run=$folder/1/home/run
]]

-- Host 2 writes a folder of all hosts and loses its power; the others may go on only then.
local SHARED = [[
boot 1; boot 2 +1h; boot 3 -1h
%s
begin 4 on 2 "$limax" run tiny.lua -q --out $run
for k in 1 3; do
  cp -r $folder/2/home/.config $folder/$k/home # with the key that sealed it
  on $k "$limax" run --resume $run -q && echo "host $k: not refused"
done
%s 2
for k in {1..100}; do ! on 3 "$limax" run --resume $run -q || break; sleep 1; done
%s
cp -r $run $folder/1/home/run
]]

-- A task of an array and a run on several ranks, both of the same experiment, which waits in its
-- generation 4 as long as the file `slow` exists.
local SLURM = [[
. "$(dirname "$0")/slurm.sh"
slurm
cd "$folder"
mkdir bin
ln -s "$limax" bin/limax
sed '/^ *fitness = /s/$/ while robot.generation > 3 and wait() do end/; 1i\
local function wait()\
  require("limax.host").wait(0.1)\
  local slow = io.open "'"$folder"'/slow"\
  return slow and slow:close()\
end' tiny.lua >walk.lua
touch slow
array() { on 1 env -C "$folder" "$limax" sweep "$@" --threads 1 --slurm >array.sh; }
array walk.lua --set seed=1,2 --out rates
for k in 2 3; do cp -r 1/home/.config $k/home; done # with the key that sealed it
(echo "#!/bin/sh"; sed -n '/^#SBATCH --nodes/,/^exec mpirun/p' "$(dirname "$0")/../../scripts/CLUSTER.md") >first.sh
sed 's/run walk.lua --out/run --resume/' first.sh >next.sh
options="--nodes=2 --ntasks-per-node=2 --cpus-per-task=1 --time=2"
job=$(batch array.sh --time=2)
batch first.sh $options
until [ -s rates/seed=2/r01/r01/metrics.jsonl ]; do sleep 0.5; done
on 1 scontrol requeue ${job}_2
jobs_end # at their time limits
on 1 scontrol show job | grep -E "JobState|ExitCode|RunTime"
rm slow
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

-- Name, what happens, and a pattern of what is printed.
local CASES = {
  { "clocks an hour apart change nothing", [[
    boot 1 +1h; boot 2; boot 3 -1h
    ranks 1 2 3 run tiny.lua -q --out run
    ranks 1 2 run --resume run --from 5 -q
  ]] },
  { "a run that loses a host ends, and goes on with others", [[
    boot 1; boot 2; boot 3
    begin 4 ranks 1 2 3 run tiny.lua -q --out run
    lose 3
    ended
    boot 4
    begin 4 ranks 1 2 4 2 run --resume run -q
    kill -KILL ${first[2]} # its kernel closes the connections: MPI may end all before limax does
    ended
    ranks 1 4 run --resume run -q
  ]], "continue with: mpirun %-n 3 [^\n]* %-%-resume run\n" },
  { "a network that stops for 30 s ends the run, which goes on", [[
    boot 1; boot 2; boot 3
    begin 4 ranks 1 2 3 run tiny.lua -q --out run
    cut 3
    sleep 30
    join 3
    ended
    ranks 1 2 3 run --resume run -q
  ]], "continue with: mpirun %-n 3 [^\n]* %-%-resume run\n", long = true },
  { "hosts lock a run that all see", SHARED:format("run=$folder/run", "lose", ""),
    "is in use by another process.*is in use by another process" },
  { "hosts lock a run on NFS, also where one is cut off for some time",
    SHARED:format("share; run=/mnt/run", "cut", "join 2; wait $job || echo status $?"),
    "is in use by another process.*is in use by another process" },
  { "jobs of Slurm end at their time limits, and go on", SLURM, "", long = true },
}

for _, case in ipairs(CASES) do
  suite:test(case[1], function(t)
    if case.long and os.getenv "LIMAX_TESTS" ~= "full" then t:skip "LIMAX_TESTS=full runs it" end
    local folder = t:folder()
    process.write(folder .. "/tiny.lua", whole_runs.experiment(GENERATIONS, 1))
    process.write(folder .. "/case.sh", FUNCTIONS .. case[2])
    local script = host.file.absolute(source.folder_of(debug.getinfo(1, "S").source:sub(2))
      .. "/../../support/hosts.sh")
    local output = process.output(("limax=%s bash %s %s '. \"$folder/case.sh\"' 2>&1; echo status $?")
      :format(process.quote(host.executable), process.quote(script), process.quote(folder)))
    local reason = output:match "skipped: ([^\n]*)"
    if reason then t:skip(reason) end
    t:ok(output:find "status 0\n$" and output:find(case[3] or ""), output)
    local experiment = host.file.exists(folder .. "/walk.lua") and "walk.lua" or "tiny.lua"
    process.completes(t, folder, { "run", experiment, "-q", "--out", "whole" })
    whole_runs.same(t, folder .. "/1/home/run", folder .. "/whole")
  end)
end
