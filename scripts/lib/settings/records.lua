--- records.lua: declares every field that a run writes: robots, generations, ledger, timing,
--- journal, configuration. record_rules.lua derives the layout in memory and on disk, the checks of
--- readers, the annotations for editors and the tables of RUN_FOLDER.md.
---
--- A row is { name, type, meaning, unit =, by =, only = }. `by` is the step that writes the field;
--- `only` names what an experiment must have for the field to exist. A type that ends in "?" may
--- have no value: NaN, -1 or an empty text in an array, absent in JSON.
---
--- Types in an array (records.robot, .body, .outcome): NumPy's i4, i8, u8, f8, and S8, a text of 8
--- bytes; [2] is a list of two, [cases] one of as many as the layout has; `body` and `outcome` are
--- the engine's structs; `measures` has a number for each name.
---
--- Types in JSON: `number` is at most 1e150, so that sums are finite; `finite` is any number;
--- `whole`, `text`, `switch` (true or false), `any`, `vector` (three numbers), `numbers`, `texts`,
--- `objects` (a list); `table` has the fields whose names begin with its own, `list` is a list of
--- such tables, `names` a table with any names (NAME in capitals); another word is a rule of
--- record_rules.lua.

local records = {}

--- A robot of a generation: rNN/robots/gNNNN.npy, and the same bytes in memory.
records.robot = {
  { "id", "i8", "unique in its repetition; an elite keeps its own", unit = "1", by = "breed" },
  { "generation", "i8", "of its first appearance", unit = "1", by = "breed" },
  { "parents", "i8[2]?", "ids; none if `initial`", unit = "1", by = "breed" },
  { "origin", "S8", "`initial`, `bred`, `elite`", by = "breed" },
  { "island", "i8", "that it is on; an elite that came from another island keeps its id, and may be"
    .. " on several", unit = "1", by = "breed", only = "islands" },
  { "age", "i8", "since the oldest ancestor", unit = "generations", by = "breed", only = "ages" },
  { "step_size", "f8?", "of its mutation", unit = "1", by = "breed", only = "self_adaptive" },
  { "body", "body", "see [Body](#body)", by = "express" },
  { "mass", "f8", "of the body", unit = "kg", by = "express" },
  { "letters", "S[letters]", "of the whole lattice: lines along x, the lowest layer first, an empty"
    .. " line between layers", by = "express" },
  { "outcome", "outcome[trials]", "see [Outcome](#outcome); of each trial, where the experiment has"
    .. " trials, else of the only simulation", by = "simulate" },
  { "status", "S8?", "`done`, `invalid`, `diverged`, `failed` (in the fitness, a descriptor or an"
    .. " objective)", by = "simulate" },
  { "reason", "S32?", "if not `done`: that of its outcome, `fitness` or `measure`",
    by = "simulate" },
  { "fitness", "f8?", "its score; none if not `done`", unit = "fitness", by = "score" },
  { "descriptors", "f8[descriptors]?", "what the archive measures, in its order",
    unit = "as measured", by = "score", only = "descriptors" },
  { "objectives", "f8[objectives]?", "what archive or survival measure, in their order; one that"
    .. " begins with a minus has its own sign", unit = "as measured", by = "score",
    only = "objectives" },
  { "novelty", "f8?", "mean distance to the nearest neighbours", unit = "1", by = "archive",
    only = "novelty" },
  { "entered", "i8?", "its place among the robots that entered the archive in this generation",
    unit = "1", by = "archive", only = "archive" },
  { "cell", "i8?", "of the archive, if it entered: of a grid the first descriptor varies fastest,"
    .. " of a CVT archive it is the place in `limax.archive.centres`; those of island 2 follow"
    .. " those of island 1", unit = "1", by = "archive", only = "archive" },
  { "cases", "f8[cases]?", "the cases that the fitness returned, for lexicase selection; the end of"
    .. " a shorter list is NaN", unit = "as in the fitness", by = "score" },
  { "measures", "measures?", "the numbers that the fitness returned by name",
    unit = "as in the fitness", by = "score" },
}

--- The struct limax_body.
records.body = {
  { "status", "i4", "1 valid, 2 no voxel, 3 no muscle", unit = "1" },
  { "voxels", "i4", "that are not empty", unit = "voxels" },
  { "counts", "i4[16]", "voxels of each material, in the order of `config.json`", unit = "voxels" },
  { "masses", "i4", "mass points", unit = "1" },
  { "springs", "i4", "", unit = "1" },
  { "size", "i4[3]", "extent along x, y, z", unit = "voxels" },
  { "reserved", "i4", "0", unit = "1" },
  { "hash", "u8", "equal for equal bodies", unit = "1" },
}

--- The struct limax_outcome.
records.outcome = {
  { "status", "i4", "0 not simulated, 2 done, 3 invalid, 4 diverged", unit = "1" },
  { "reason", "i4?", "invalid: as the status of the body; diverged: 1 nonfinite, 2 speed, 3"
    .. " stretch, 4 control", unit = "1" },
  { "step", "i8", "done since settling began", unit = "steps" },
  { "steps", "i8", "in all", unit = "steps" },
  { "time", "f8?", "of the last step, from t = 0", unit = "s" },
  { "time_step", "f8?", "", unit = "s" },
  { "time_step_bound", "f8?", "of this body, integrator and scene", unit = "s" },
  { "masses", "i4", "mass points", unit = "1" },
  { "springs", "i4", "", unit = "1" },
  { "coarse", "i4", "1: a mass moved farther than a tenth of an edge in one step", unit = "1" },
  { "reserved", "i4", "0", unit = "1" },
  { "mass", "f8?", "of the body", unit = "kg" },
  { "center_start", "f8[3]?", "centre of mass at t = 0", unit = "m" },
  { "center_middle", "f8[3]?", "likewise after half of the steps", unit = "m" },
  { "center_end", "f8[3]?", "likewise at the end", unit = "m" },
  { "path_length", "f8?", "of the trace `center_of_mass`, as are the following of theirs",
    unit = "m" },
  { "height", "f8?", "highest rise of the centre of mass", unit = "m" },
  { "contact", "f8?", "mean share of the masses in contact", unit = "1" },
  { "kinetic", "f8?", "mean kinetic energy", unit = "J" },
  { "elastic", "f8?", "mean energy of springs and contacts", unit = "J" },
  { "muscle_work", "f8?", "positive work of the muscles", unit = "J" },
  { "strain", "f8?", "mean over springs and time", unit = "1" },
  { "strain_most", "f8?", "largest", unit = "1" },
  { "block_start", "f8[3]?", "centre of the first rigid block at t = 0", unit = "m" },
  { "block_middle", "f8[3]?", "likewise after half of the steps", unit = "m" },
  { "block_end", "f8[3]?", "likewise at the end", unit = "m" },
  { "block_velocity", "f8[3]?", "at the end", unit = "m/s" },
  { "block_upright", "f8?", "cosine of the angle between its own z axis and the world's",
    unit = "1" },
}

--- A number over the scored robots that have it.
records.spread = {
  { "champion", "number?", "the champion's", unit = "likewise" },
  { "mean", "number", "", unit = "likewise" },
  { "least", "number", "", unit = "likewise" },
  { "most", "number", "", unit = "likewise" },
}

--- The diversity of a set of robots.
records.diversity = {
  { "hamming", "number", "mean share of voxels in which two robots differ", unit = "1" },
  { "genotype", "number?", "root mean square over the genes of the standard deviation over the"
    .. " robots", unit = "1" },
  { "control", "number?", "the same of the genes of control, which `genotype` leaves out; absent"
    .. " without any", unit = "1" },
  { "distinct", "whole", "different bodies", unit = "1" },
  { "robots", "whole", "in the set", unit = "robots" },
  { "material_shares", "names", "of all voxels, empty ones included, in the mean" },
  { "material_shares.MATERIAL", "number", "", unit = "1" },
}

--- A generation: a line of rNN/metrics.jsonl, and an entry of the history.
records.generation = {
  { "best", "number", "largest", unit = "fitness", by = "record" },
  { "best_standard", "number?", "the champion's, under the first materials; absent if that"
    .. " simulation fails", unit = "fitness", by = "record" },
  { "mean", "number", "", unit = "fitness", by = "record" },
  { "median", "number", "`quantiles.q50`", unit = "fitness", by = "record" },
  { "worst", "number", "smallest", unit = "fitness", by = "record" },
  { "quantiles", "table", "linear between neighbours", by = "record" },
  { "quantiles.q10", "number", "", unit = "fitness" },
  { "quantiles.q25", "number", "", unit = "fitness" },
  { "quantiles.q50", "number", "", unit = "fitness" },
  { "quantiles.q75", "number", "", unit = "fitness" },
  { "quantiles.q90", "number", "", unit = "fitness" },
  { "scored", "whole", "with a score", unit = "robots", by = "record" },
  { "evaluations", "whole", "simulated, without elites that keep their score", unit = "robots",
    by = "record" },
  { "coarse", "whole", "of which a mass moved farther than a tenth of an edge in one step",
    unit = "robots", by = "record" },
  { "failed", "table", "without a score, by cause", by = "record" },
  { "failed.invalid", "whole", "without a body that can be simulated", unit = "robots" },
  { "failed.diverged", "whole", "whose simulation exceeded the bounds of speed or stretch, or"
    .. " became non-finite", unit = "robots" },
  { "failed.fitness", "whole", "whose fitness failed, or was not finite", unit = "robots" },
  { "champion", "table", "the best robot", by = "record" },
  { "champion.id", "whole", "", unit = "1" },
  { "champion.index", "index", "its place in the population", unit = "1" },
  { "champion.hash", "text", "of its body" },
  { "measures", "names?", "numbers that the fitness returned by name", by = "record" },
  { "measures.NAME", "spread", "", unit = "as in the fitness" },
  { "novelty", "spread?", "", unit = "1", by = "record", only = "novelty" },
  { "age", "spread?", "", unit = "generations", by = "record", only = "ages" },
  { "step_size", "spread?", "", unit = "1", by = "record", only = "self_adaptive" },
  { "islands", "list?", "of each island", by = "record", only = "islands" },
  { "islands[].scored", "whole", "", unit = "robots" },
  { "islands[].best", "number?", "absent if none has a score, as is the next", unit = "fitness" },
  { "islands[].mean", "number?", "", unit = "fitness" },
  { "archive", "table?", "", by = "archive", only = "archive" },
  { "archive.filled", "whole", "in the archive", unit = "robots" },
  { "archive.best", "number?", "largest in the archive; absent if it is empty", unit = "fitness" },
  { "archive.cells", "whole?", "of a grid or CVT archive", unit = "1" },
  { "archive.coverage", "number?", "`filled` over `cells`", unit = "1" },
  { "archive.qd_score", "finite?", "sum over the filled cells of the fitness minus the archive's"
    .. " `qd_offset`", unit = "fitness" },
  { "front", "table?", "", by = "record", only = "objectives" },
  { "front.size", "whole", "that none dominates, in a Pareto archive or else in the population; of"
    .. " equal ones the first", unit = "robots" },
  { "front.hypervolume", "finite?", "between a `reference` point and the front",
    unit = "product of the objectives" },
  { "diversity", "table", "over robots with a score", by = "record" },
  { "diversity.all", "diversity", "of all" },
  { "diversity.top", "diversity", "of the better half, rounded up" },
  { "parameters", "table", "that bred it; of generation 0 those of `config.json`",
    by = "supervise" },
  { "parameters.mutation_rate", "number", "", unit = "per gene" },
  { "parameters.mutation_scale", "number", "", unit = "1" },
  { "parameters.crossover_rate", "number", "", unit = "per gene" },
  { "parameters.elite_fraction", "number", "", unit = "of the population" },
  { "parameters.control_mutation_rate", "number?", "with genes of control, as the next",
    unit = "per gene" },
  { "parameters.control_mutation_scale", "number?", "", unit = "1" },
  { "materials", "names", "of this generation, without the empty material", by = "supervise" },
  { "materials.MATERIAL", "table", "" },
  { "materials.MATERIAL.stiffness", "number", "", unit = "N/m" },
  { "materials.MATERIAL.amplitude", "number?", "of a muscle, as a share of the rest length",
    unit = "1" },
  { "materials.MATERIAL.phase", "number?", "of a muscle", unit = "rad" },
  { "supervisor_failed", "switch?", "true where the supervisor raised an error, took too long,"
    .. " returned no table, or a language model gave no usable answer: its fallback decided, or"
    .. " parameters and materials stayed", by = "supervise" },
}

--- Fields of an entry of the history besides those of its line.
records.history = {
  { "repetition", "index", "1, 2, ...", unit = "1" },
  { "generation", "whole", "0, 1, ...", unit = "1" },
  { "population", "limax.population.scored", "its robots; without a folder only those of the last"
    .. " three generations have genomes" },
  { "ledger", "limax.ledger.line", "how it got its parameters" },
  { "materials", "table", "that it was made of, as a material file holds them" },
}

--- The origin of a generation's parameters: a line of rNN/ledger.jsonl.
records.ledger = {
  { "supervisor", "text", "its name, or `function`; for a replay `llm`", by = "supervise" },
  { "source", "text?", "for `llm`, the source of the values: `model`, the fallback's name, `keep`,"
    .. " or `held` (not asked, see `ask_every`)", by = "supervise" },
  { "reason", "text?", "the supervisor's explanation, or how it failed", by = "supervise" },
  { "entries", "list", "none in generation 0; else one per field, and one per proposed field that"
    .. " is unknown", by = "supervise" },
  { "entries[].field", "text", "`mutation_rate`, ..., `materials.MATERIAL.stiffness`, ..., or an"
    .. " unknown proposed field" },
  { "entries[].before", "number?", "value in the previous generation; absent for an unknown field",
    unit = "as the field" },
  { "entries[].proposed", "any?", "value, or a text if it is not a finite number; absent if nothing"
    .. " was proposed", unit = "as the field" },
  { "entries[].applied", "number?", "value in this generation; absent for an unknown field",
    unit = "as the field" },
  { "entries[].outcome", "text", "`accepted`, `clamped` (range or cost), `rate-limited`, `kept`,"
    .. " `rejected`, `set` (by a script's own loop)" },
  { "entries[].reason", "text?", "why not `accepted`" },
}

--- The costs of a generation: a line of rNN/timing.jsonl.
records.timing = {
  { "ended", "text", "UTC, when its files were written", by = "record" },
  { "seconds", "table", "of each step", by = "record" },
  { "seconds.supervise", "number", "supervisor and ledger, before this generation was bred",
    unit = "s" },
  { "seconds.breed", "number", "selection, crossover and mutation, or the initial genomes",
    unit = "s" },
  { "seconds.express", "number", "genomes to bodies, and their rows", unit = "s" },
  { "seconds.simulate", "number", "that the host spent on it or waited for it; a GPU already steps"
    .. " while the files of the generation before are written", unit = "s" },
  { "seconds.fitness", "number", "the fitness, and what archive and survival measure", unit = "s" },
  { "seconds.ranks", "number?", "on several ranks of `mpirun`: that rank 0 waited for the others"
    .. " and exchanged scores with them; the other times are its own", unit = "s" },
  { "seconds.write", "number", "that the run waited for the files of earlier generations; on"
    .. " several ranks, until all had written this one", unit = "s" },
  { "supervision", "table?", "absent in generation 0", by = "supervise" },
  { "supervision.proposed", "whole", "number of proposed fields", unit = "1" },
  { "supervision.accepted", "number?", "share of these; absent if nothing was proposed, as are the"
    .. " next three", unit = "1" },
  { "supervision.clamped", "number?", "", unit = "1" },
  { "supervision.rate_limited", "number?", "", unit = "1" },
  { "supervision.rejected", "number?", "", unit = "1" },
  { "supervision.fallen_back", "switch?", "for `llm` and `replay`: the values are not the"
    .. " model's" },
  { "supervision.asks", "whole?", "for `llm`: questions, second ones of a generation included",
    unit = "1" },
  { "supervision.attempts", "whole?", "requests sent for them", unit = "1" },
  { "supervision.model_seconds", "number?", "spent waiting for the model; part of"
    .. " `seconds.supervise`", unit = "s" },
  { "supervision.input_tokens", "finite?", "as the endpoint reports them", unit = "tokens" },
  { "supervision.output_tokens", "finite?", "likewise", unit = "tokens" },
}

--- The lines of journal.jsonl, by their `kind`.
records.journal = {
  begin = {
    { "at", "whole", "where this line begins in the journal", unit = "bytes" },
    { "started", "text", "UTC, when a process began to write, as `2026-11-21T10:15:03Z`" },
    { "version", "text", "of limax" },
    { "commit", "text?", "that limax was built from" },
    { "ranks", "whole?", "of `mpirun`, where there were several; `machine` and `device` are those"
      .. " of rank 0", unit = "1" },
    { "config", "file", "the configuration from here on" },
    { "config_hash", "hash", "of its text" },
    { "transcript", "whole?", "size of `transcript.jsonl`, where a model was asked before",
      unit = "bytes" },
    { "machine", "table", "" },
    { "machine.compiler", "text?", "that built the executable" },
    { "machine.build", "text?", "the build type: `Release`, ..." },
    { "machine.cpu", "text?", "the processor's name" },
    { "machine.cores", "whole?", "available to the process", unit = "1" },
    { "machine.hostname", "text?", "" },
    { "machine.system", "text?", "distribution and kernel" },
    { "machine.luajit", "text?", "" },
    { "machine.cuda", "text?", "version of the NVIDIA driver" },
    { "machine.cuda_compiler", "text?", "the nvcc of the build" },
    { "device", "table", "" },
    { "device.kind", "text", "`cpu` or `cuda`" },
    { "device.compiler", "text?", "that built the engine" },
    { "device.build", "text?", "" },
    { "device.cpu", "text?", "" },
    { "device.cores", "whole?", "", unit = "1" },
    { "device.threads", "whole?", "for the simulation", unit = "1" },
    { "device.isa", "text?", "the instruction set in use" },
    { "device.isa_available", "text?", "those of the processor, best first" },
    { "device.cuda", "text?", "for `cuda` the driver's CUDA version; for `cpu` why it is not"
      .. " `cuda`" },
    { "device.nvrtc", "text?", "version of the kernel compiler, or why there is none" },
    { "device.kernel_cache", "text?", "folder of compiled kernels; empty if there is none" },
    { "device.gpus", "list?", "the GPUs in use" },
    { "device.gpus[].ordinal", "whole", "its number, from 0, among the GPUs of"
      .. " `CUDA_VISIBLE_DEVICES`", unit = "1" },
    { "device.gpus[].name", "text", "" },
    { "device.gpus[].uuid", "text?", "" },
    { "device.gpus[].capability", "text?", "compute capability, `9.0`" },
    { "device.gpus[].multiprocessors", "whole?", "", unit = "1" },
    { "device.gpus[].memory", "whole?", "", unit = "bytes" },
    { "device.gpus_too_old", "list?", "GPUs that limax cannot use" },
    { "device.gpus_too_old[].name", "text", "" },
    { "device.gpus_too_old[].capability", "text?", "" },
  },
  generation = {
    { "repetition", "index", "from 1", unit = "1" },
    { "generation", "whole", "from 0", unit = "1" },
    { "scored_by", "hash", "of all that affects the scores" },
    { "evaluations", "whole", "in this repetition up to here", unit = "robots" },
    { "recent", "switch?", "true: its robots and genomes are removed after three more"
      .. " generations" },
    { "files", "table", "size in bytes and hash of each file; of robots and genomes also"
      .. " bytes of a row" },
    { "files.robots", "part", "`rNN/robots/gNNNN.npy`" },
    { "files.genomes", "part", "`rNN/genomes/gNNNN.npy`" },
    { "files.champion", "part", "`rNN/champions/gNNNN.json`" },
    { "files.matrix", "part?", "`rNN/B.npy`, in generation 0" },
    { "lines", "table", "end of the generation's line in each growing file, bytes, and its hash" },
    { "lines.metrics", "part", "" },
    { "lines.ledger", "part", "" },
    { "lines.timing", "part", "" },
    { "transcript", "whole?", "size of `transcript.jsonl` when the generation ended, which only"
      .. " grows", unit = "bytes" },
    { "state", "any?", "of the experiment's functions, as the scores left it" },
  },
  cut = {
    { "at", "whole", "where this line begins in the journal", unit = "bytes" },
    { "from", "whole", "later generations of these repetitions do not exist", unit = "1" },
    { "repetitions", "numbers", "", unit = "1" },
  },
  ["end"] = {
    { "at", "whole", "where this line begins in the journal", unit = "bytes" },
    { "state", "state", "`done`, `stopped`, `failed`" },
    { "message", "text?", "why it failed" },
    { "ended", "text", "UTC" },
  },
}

--- config.json.
records.run = {
  { "schema", "text", "`limax.config/2`" },
  { "name", "text", "of the experiment" },
  { "seed", "seed", "a number, or its digits as text above 2^53", unit = "1" },
  { "lattice", "lattice", "along x, y, z", unit = "voxels" },
  { "population", "population", "in each generation", unit = "robots" },
  { "generations", "generations", "in each repetition", unit = "generations" },
  { "evaluations", "whole?", "a repetition ends before the generation that might exceed this number"
    .. " of simulated robots", unit = "robots" },
  { "repetitions", "repetitions", "of the whole evolution", unit = "repetitions" },
  { "genome", "any", "see [REFERENCE.md](REFERENCE.md#fields-of-an-experiment)" },
  { "breeding", "any", "see [REFERENCE.md](REFERENCE.md#fields-of-an-experiment); the initial"
    .. " values, which a supervisor may change" },
  { "fitness", "choice", "see [Choice](#choice)" },
  { "selection", "choice", "see [Choice](#choice)" },
  { "supervisor", "choice", "see [Choice](#choice)" },
  { "survival", "choice?", "see [Choice](#choice); where it is not \"elitist\"" },
  { "archive", "choice?", "see [Choice](#choice)" },
  { "state", "choice?", "see [Choice](#choice)" },
  { "islands", "any?", "see [REFERENCE.md](REFERENCE.md#fields-of-an-experiment)" },
  { "trials", "objects?", "see [Trials](#trials); for a function of the script, its record as in"
    .. " [Choice](#choice)" },
  { "supervision", "any", "see [REFERENCE.md](REFERENCE.md#fields-of-an-experiment); `ranges` only"
    .. " where the experiment has them" },
  { "materials", "any", "see [Materials](#materials)" },
  { "scene", "any", "see [REFERENCE.md](REFERENCE.md#fields-of-an-experiment), and"
    .. " [Scene](#scene)" },
  { "simulation", "simulation", "see [REFERENCE.md](REFERENCE.md#fields-of-an-experiment)" },
  { "simulation.accuracy", "text", "the tier: `preview`, `evolve`, `publish`, `reference`" },
  { "record", "traces", "see [REFERENCE.md](REFERENCE.md#fields-of-an-experiment); 0 for none."
    .. " Traces are not stored" },
  { "record_population", "kept?", "the experiment's `record.population`, where it is not `all`" },
  { "not_in_paper", "texts?", "choices that are not from the paper, as the script states them" },
  { "run", "table", "" },
  { "run.repetition", "index?", "`--repetition`, if only one is computed", unit = "1" },
  { "run.path", "line?", "absolute path of the script that returned the experiment" },
  { "run.script", "text?", "that script's name below `scripts/`" },
  { "run.scripts", "list", "the scripts and prompts below `scripts/`" },
  { "run.scripts[].file", "below", "its name there" },
  { "run.scripts[].sha256", "text", "of its text" },
  { "run.own_loop", "switch?", "true if a script made the folder by `limax.start`: that script"
    .. " continues it" },
  { "run.overrides", "texts", "the arguments of `--set`, in order" },
  { "seal", "table?", "whose configuration it is: see [Trust](#trust)" },
  { "seal.key", "text", "first digits of the SHA-256 of that user's key" },
  { "seal.hmac", "text", "HMAC-SHA256 of the text without this field" },
}

--- study.json: the runs of a sweep or a study.
records.study = {
  { "schema", "text", "`limax.study/2`" },
  { "script", "table?", "of a sweep" },
  { "script.path", "line", "absolute" },
  { "script.scripts", "list", "it and the files that it requires or names" },
  { "script.scripts[].file", "below", "relative to the script's folder, or the file's name" },
  { "script.scripts[].sha256", "text", "of its text" },
  { "runs", "list", "" },
  { "runs[].path", "below", "below this folder" },
  { "runs[].arm", "line?", "its name in comparisons" },
  { "runs[].donor", "line?", "whose parameters it repeats" },
  { "runs[].tuning_evaluations", "whole?", "spent before it", unit = "robots" },
  { "runs[].repetition", "whole?", "", unit = "1" },
  { "runs[].changes", "texts?", "arguments of `--set`" },
  { "seal", "table?", "as in config.json" },
}

return records
