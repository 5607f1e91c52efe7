/* limax.h: the public API of the engine: opaque handles, plain structs by pointer, status codes.
 *
 * A C11 header that includes only <stdint.h>. The text between the two marks below has no
 * preprocessor lines, so LuaJIT's FFI reads it unchanged. Units are SI. Arrays are row-major and
 * their shapes are written [robot][mass][3]. Indices start at 0 here and at 1 in Lua.
 *
 * Every function that can fail returns a limax_status and stores a message for
 * limax_error_text(), one per thread. No function throws, calls back, or takes or returns a struct
 * by value. Long work is split into ranges of robots or slices of time that the caller loops over,
 * so that each call can return within about 50 ms. Not divisible are creating an encoding,
 * preparing one robot (about 5 us per voxel), ranking points (10,000 of 2 objectives in 2 ms, of 3
 * in 14 ms, of 8 in 140 ms) and a number of steps that the caller requests.
 *
 * Pointers must not be null unless documented otherwise: a null is refused, and a function that
 * returns no status then returns 0, null or NaN and stores a message. The caller must guarantee
 * that arrays are as large as documented. The caller owns each handle that it creates and frees it
 * with its `_free`, which accepts null. Children keep what they need of their parents alive, so
 * handles may be freed in any order.
 *
 * All functions may be called from any thread. Threads may share a cpu device, encodings, and
 * materials and scenes that none of them changes. A population or a simulation takes one call at a
 * time: a call whose handle is in use by another is refused. Not checked are reading a view (a
 * pointer returned by a function here) while another thread changes its data, freeing a handle
 * that another thread uses, and using one cuda device from several threads. */
#ifndef LIMAX_H
#define LIMAX_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif
#pragma GCC visibility push(default)
/* ---- cdef begins ---- */

/* ---- status, version, interruption ----------------------------------------------------------- */

typedef enum limax_status {
    LIMAX_OK = 0,
    LIMAX_INVALID_ARGUMENT = 1, /* a value outside its range: the text names both */
    LIMAX_INVALID_FILE = 2,     /* a malformed file: the text names file, field, value, range */
    LIMAX_IO = 3,               /* a file that cannot be read or written */
    LIMAX_OUT_OF_MEMORY = 4,    /* the text gives the size needed, if known */
    LIMAX_NO_DEVICE = 5,        /* the device is unavailable: the text gives the reason */
    LIMAX_INTERNAL = 6          /* a defect of the engine */
} limax_status;

enum {
    LIMAX_ABI = 16, /* raised whenever a declaration of this file changes */
    LIMAX_MAX_MATERIALS = 16,
    LIMAX_MAX_HIDDEN = 8
};

uint32_t limax_abi_version(void);
const char* limax_version(void);
/* Text of the last failure on this thread; empty before the first. Valid until the next one. */
const char* limax_error_text(void);
/* Bytes that all handles hold, on this machine and on its GPUs. */
uint64_t limax_bytes_held(void);

/* Asks every running and future call to stop at its next whole step. Safe in a signal handler. */
void limax_interrupt(void);
void limax_interrupt_clear(void);
int32_t limax_interrupted(void);

/* ---- device ---------------------------------------------------------------------------------- */

typedef struct limax_device limax_device;

/* `name` is "auto", "cpu" or "cuda". `threads` is 1 to 1024, or 0 for one per core this process may
 * use. `isa` picks the CPU passes: null for the fastest, or "x86-64-v4", "x86-64-v3", "baseline",
 * which give the same bits. */
limax_status limax_device_create(const char* name, int32_t threads, const char* isa,
                                 limax_device** out);
void limax_device_free(limax_device* device);
/* JSON object: kind, threads, isa, isa_available, cpu, compiler, build, cuda; a CUDA
 * device adds gpus, nvrtc and kernel_cache, and gpus_too_old where there are some. Valid until the
 * handle is freed. */
const char* limax_device_describe(const limax_device* device);

/* ---- materials ------------------------------------------------------------------------------- */

typedef struct limax_materials limax_materials;

typedef enum limax_material_kind {
    LIMAX_EMPTY = 0,
    LIMAX_PASSIVE = 1,
    LIMAX_EXPANDING = 2,  /* a muscle with s = +1 */
    LIMAX_CONTRACTING = 3 /* a muscle with s = -1 */
} limax_material_kind;

typedef struct limax_material {
    char name[32];
    char letter[4]; /* one ASCII letter, then zeros */
    int32_t kind;   /* limax_material_kind */
    int32_t reserved[2];
    double stiffness;       /* N/m */
    double mass_per_site;   /* kg */
    double damping_ratio;   /* 1 */
    double amplitude;       /* largest relative change of rest length, 1 */
    double phase;           /* largest phase, rad */
    double stiffness_floor; /* smallest stiffness weight, 1 */
} limax_material;

/* Reads a table (JSON, schema limax.materials/1, at most 1 MiB). `origin`, which may be null, names
 * the text in errors. Material 0 is always empty. */
limax_status limax_materials_load(const char* path, limax_materials** out);
limax_status limax_materials_parse(const char* text, uint64_t length, const char* origin,
                                   limax_materials** out);
limax_status limax_materials_copy(const limax_materials* materials, limax_materials** out);
void limax_materials_free(limax_materials* materials);
int32_t limax_materials_count(const limax_materials* materials);
const char* limax_materials_name(const limax_materials* materials);
limax_status limax_materials_get(const limax_materials* materials, int32_t index,
                                 limax_material* out);
/* Sets one of a material's doubles by name, range checked. */
limax_status limax_materials_set(limax_materials* materials, int32_t index, const char* field,
                                 double value);
/* Unit, range and source of a field. Strings are valid until the handle is freed. */
limax_status limax_materials_field(const limax_materials* materials, const char* field,
                                   const char** unit, double* minimum, double* maximum,
                                   const char** source);

/* ---- genome: encoding and network ------------------------------------------------------------ */

typedef struct limax_encoding limax_encoding;

typedef enum limax_network {
    /* Features cos and sin of 2 pi B v of each voxel centre v; hidden units are tanh. */
    LIMAX_NETWORK_FOURIER = 0,
    /* Inputs x, y, z of the centre, -1 to 1, and its distance from the middle; hidden unit k of a
     * layer is by k mod 4: sine, Gaussian, tanh, absolute value. */
    LIMAX_NETWORK_CPPN = 1,
    /* The genes are the outputs, [materials + 3][voxel]. */
    LIMAX_NETWORK_DIRECT = 2,
    /* Genes without a meaning here: the caller writes the bodies. */
    LIMAX_NETWORK_NONE = 3
} limax_network;

/* Options that the network does not need are ignored. */
typedef struct limax_encoding_options {
    int32_t lattice[3];   /* voxels along x, y, z */
    int32_t features;     /* m: rows of B, 1 to 1024; fourier */
    double sigma;         /* standard deviation of B's entries, 0 to 100; fourier */
    int32_t hidden_count; /* 0 to LIMAX_MAX_HIDDEN; fourier, cppn */
    int32_t hidden[8];    /* width of each hidden layer, 1 to 1024 */
    int32_t materials;    /* classes of the softmax, 2 to LIMAX_MAX_MATERIALS */
    double initial_scale; /* factor on the initial weights, 0 to 100 */
    uint64_t seed;
    uint32_t repetition;   /* 1 to 2^24 - 1 */
    int32_t network;       /* limax_network */
    int32_t genes;         /* numbers of a genome, 1 to 2^24, or 0 with genes of control; none */
    int32_t control_genes; /* that follow the others in a genome and give no body, 0 to 4096 */
    double control_spread; /* standard deviation of their initial values, 0 to 100 */
} limax_encoding_options;

/* Computes what the network reads of every voxel centre; B is drawn for this seed and repetition.
 */
limax_status limax_encoding_create(const limax_encoding_options* options, limax_encoding** out);
void limax_encoding_free(limax_encoding* encoding);
/* Of a genome: those of the network, then those of control. */
int32_t limax_encoding_genes(const limax_encoding* encoding);
int32_t limax_encoding_control_genes(const limax_encoding* encoding);
/* Null where the network has none: B, [feature][3], of fourier; the inputs of the first layer, of
 * fourier cos, sin: [2 m][voxel], of cppn x, y, z, distance: [4][voxel]. */
const double* limax_encoding_matrix(const limax_encoding* encoding);
const float* limax_encoding_features(const limax_encoding* encoding);

/* ---- random numbers: functions of their arguments only (Philox4x32-10) ----------------------- */

typedef enum limax_stream {
    LIMAX_STREAM_ENCODING = 1,
    LIMAX_STREAM_INITIAL = 2,
    LIMAX_STREAM_BREEDING = 3,
    LIMAX_STREAM_SELECTION = 4,
    LIMAX_STREAM_SUPERVISION = 5,
    LIMAX_STREAM_USER = 6,
    LIMAX_STREAM_VARIATION = 7 /* mutation, crossover and first genomes by scripts */
} limax_stream;

typedef struct limax_random_key {
    uint64_t seed;
    uint32_t repetition; /* only the lower 24 bits are used */
    uint32_t stream;     /* limax_stream */
    uint32_t generation;
    uint32_t individual;
} limax_random_key;

double limax_random_uniform(const limax_random_key* key, uint32_t draw); /* in [0, 1), 53 bits */
double limax_random_normal(const limax_random_key* key, uint32_t draw);  /* N(0, 1) */
/* 0 to n - 1, each with the same probability to within n / 2^64; 0 for n = 0. */
uint32_t limax_random_integer(const limax_random_key* key, uint32_t draw, uint32_t n);

/* ---- population: genomes and bodies ---------------------------------------------------------- */

typedef struct limax_population limax_population;

typedef enum limax_body_status {
    LIMAX_BODY_UNKNOWN = 0, /* not expressed or checked yet */
    LIMAX_BODY_VALID = 1,
    LIMAX_BODY_NO_VOXEL = 2,
    LIMAX_BODY_NO_MUSCLE = 3 /* only where the caller requires one */
} limax_body_status;

typedef struct limax_body {
    int32_t status;     /* limax_body_status */
    int32_t voxels;     /* voxels that are not empty */
    int32_t counts[16]; /* voxels of each material, empty included */
    int32_t masses;
    int32_t springs;
    int32_t size[3]; /* extent of the body in voxels along x, y, z */
    int32_t reserved;
    uint64_t hash; /* of lattice and voxels: equal bodies have equal hashes */
} limax_body;

/* `encoding` may be null: then the population has no genomes and the caller writes the bodies.
 * LIMAX_OUT_OF_MEMORY for robots that would not fit this machine's memory, with the size. */
limax_status limax_population_create(const int32_t lattice[3], int32_t count,
                                     const limax_encoding* encoding, limax_population** out);
void limax_population_free(limax_population* population);
int32_t limax_population_count(const limax_population* population);
/* Views into the population, valid until it is freed. After writing genomes call express, after
 * writing bodies call check. Once a GPU has expressed or bred, it stores the population: each call
 * then copies the current data to the host, and views of earlier calls are out of date after the
 * next change on the GPU. Null, with an error text, if the copy fails. Genomes are [robot][gene],
 * null without an encoding; voxels are material indices, [robot][z][y][x]; weights are stiffness,
 * amplitude, phase, [robot][3][z][y][x]; bodies are [robot]. */
float* limax_population_genomes(limax_population* population);
uint8_t* limax_population_voxels(limax_population* population);
float* limax_population_weights(limax_population* population);
const limax_body* limax_population_bodies(const limax_population* population);
/* `before` robots of the generation come before the first of this population, 0 if never called:
 * random numbers of a robot depend on its number in the generation. */
limax_status limax_population_number(limax_population* population, int32_t before);
/* A copy of the genomes of robots first .. first + count - 1, [count][gene]. Unlike a view it does
 * not move the population off the GPU. */
limax_status limax_population_read_genomes(const limax_population* population, int32_t first,
                                           int32_t count, float* out);
/* Sets the genomes of these robots, on the GPU if it stores them. Their bodies become unknown. */
limax_status limax_population_write_genomes(limax_population* population, int32_t first,
                                            int32_t count, const float* in);

/* The voxels of robots as texts: a letter for each, from `letters` [16] by material index, lines
 * along x, an empty line between layers, the lowest first; each ends in a zero. `out` holds
 * [count][(nx + 1) ny nz + nz]. It does not move the population off the GPU. */
limax_status limax_population_text(const limax_population* population, int32_t first, int32_t count,
                                   const char* letters, char* out);

/* Random genomes of a range of robots: weights N(0, 1 / fan_in) times initial_scale, biases 0;
 * without layers N(0, initial_scale^2). Genes of control are N(0, control_spread^2). 0 is the first
 * generation; every other one gives new robots.
 */
limax_status limax_population_initialize(limax_population* population, uint32_t generation,
                                         limax_device* device, int32_t first, int32_t count);
/* Genomes to bodies: network, argmax, sigmoids, validity. With largest_part only the largest
 * face-connected component stays. Refuses genomes of LIMAX_NETWORK_NONE. */
limax_status limax_population_express(limax_population* population,
                                      const limax_materials* materials, int32_t require_muscle,
                                      int32_t largest_part, limax_device* device, int32_t first,
                                      int32_t count);
/* Counts and validity of bodies that the caller wrote, after removing all but the largest component
 * if largest_part is set. Refuses material indices and weights out of range. */
limax_status limax_population_check(limax_population* population, const limax_materials* materials,
                                    int32_t require_muscle, int32_t largest_part, int32_t first,
                                    int32_t count);
/* Makes the status of bodies unknown, until they are checked or expressed. */
limax_status limax_population_forget(limax_population* population, int32_t first, int32_t count);

typedef struct limax_breeding {
    double mutation_rate;  /* per gene, 0 to 1 */
    double mutation_scale; /* standard deviation of a mutation, 0 to 100 */
    double crossover_rate; /* probability that a gene comes from the second parent, 0 to 1 */
    uint64_t seed;
    uint32_t repetition;
    uint32_t generation; /* of the children */
    int32_t elites;      /* the first `elites` children are copies of their first parent */
    int32_t reserved;
    /* of the genes of control, instead of mutation_rate and mutation_scale */
    double control_mutation_rate;
    double control_mutation_scale;
} limax_breeding;

/* Writes the genomes of a range of children. `pairs` is [child][2], indices into `parents`. */
limax_status limax_population_breed(limax_population* children, const limax_population* parents,
                                    const int32_t* pairs, const limax_breeding* breeding,
                                    limax_device* device, int32_t first, int32_t count);

typedef struct limax_diversity {
    double hamming;   /* mean share of voxels in which two robots of the set differ, 0 to 1 */
    double genotype;  /* root mean square over genes of the standard deviation over the set */
    double control;   /* the same of the genes of control, which genotype leaves out */
    int32_t distinct; /* number of different bodies */
    int32_t robots;   /* size of the set */
    double material_shares[16]; /* mean share of each material over all voxels of the set */
} limax_diversity;

/* `robots` lists `count` indices. Linear in the set. Genotype and control are NaN without such
 * genes; hamming is 0 for one robot. */
limax_status limax_population_diversity(const limax_population* population, const int32_t* robots,
                                        int32_t count, limax_diversity* out);
/* The same of a set whose robots are in several populations: the largest of the sets' largest
 * absolute genes, each 0 without genes or robots and not finite where a gene is not, then the sum
 * of their sums, [limax_population_sums_size], and the number of different bodies. A set has less
 * than 2^31 robots. */
limax_status limax_population_largest_gene(const limax_population* population,
                                           const int32_t* robots, int32_t count, float* out);
int64_t limax_population_sums_size(const limax_population* population);
limax_status limax_population_sums(const limax_population* population, const int32_t* robots,
                                   int32_t count, float largest_gene, int64_t* sums);
limax_status limax_population_diversity_of(const limax_population* population, const int64_t* sums,
                                           float largest_gene, int32_t distinct, int32_t count,
                                           limax_diversity* out);
/* How many of `count` hashes of bodies differ. */
limax_status limax_distinct(const uint64_t* hashes, int32_t count, int32_t* out);

/* Non-dominated ranks, 0 for the front, and crowding distances (K. Deb et al., "A fast and elitist
 * multiobjective genetic algorithm: NSGA-II", IEEE Trans. Evol. Comp. 6, 2002) of `count` points,
 * `values` [count][objectives], larger is better, 1 to 8 objectives, infinity allowed, NaN refused.
 * Equal points have the same rank. A distance is the sum over objectives of the gap between the
 * neighbours on both sides, divided by the extent of the rank; infinity at the ends. Of equal
 * points the first has the distance, the others 0. An objective that is the same, or infinitely far
 * apart, over a rank adds nothing else. */
limax_status limax_pareto_rank(const double* values, int32_t count, int32_t objectives,
                               int32_t* rank, double* crowding);

/* ---- scene: the list of its effects ---------------------------------------------------------- */

typedef struct limax_scene limax_scene;

typedef struct limax_effect_info {
    const char* name;
    const char* summary;
    const char* needs; /* effects, separated by commas, one of which the scene must have */
    int32_t fields;
    int32_t instances; /* how many a scene may have */
} limax_effect_info;

typedef struct limax_field_info {
    const char* name;
    const char* unit;
    const char* note;
    int32_t components; /* 1, 3 for a vector, 0 for a table: see limax_scene_set_heights */
    int32_t whole;      /* 1: whole numbers only */
    double minimum;     /* of each component, inclusive */
    double maximum;
    double value[3]; /* the default */
} limax_field_info;

int32_t limax_effect_count(void);
limax_status limax_effect_describe(int32_t effect, limax_effect_info* out);
limax_status limax_effect_field(int32_t effect, int32_t field, limax_field_info* out);
/* A number among the options of "simulation", "genome" or "breeding". */
limax_status limax_option_field(const char* group, int32_t field, limax_field_info* out);

limax_status limax_scene_create(limax_scene** out);
void limax_scene_free(limax_scene* scene);
/* Adds an effect with its defaults. The order of effects and instances does not matter. */
limax_status limax_scene_add(limax_scene* scene, const char* effect);
/* Sets a field of an effect that was added, of its last instance. */
limax_status limax_scene_set(limax_scene* scene, const char* effect, const char* field,
                             const double* values, int32_t count);
/* Sets a field that is a table of heights, [nx][ny], from 2 x 2 to 512 x 512; it is copied. */
limax_status limax_scene_set_heights(limax_scene* scene, const char* effect, const char* field,
                                     const double* heights, int32_t nx, int32_t ny);
/* A number or a vector that the text of a scripted effect may name. */
typedef struct limax_script_parameter {
    const char* name;
    int32_t components; /* 1 or 3 */
    int32_t reserved;
    double value[3];
} limax_script_parameter;

/* Adds an effect that a text describes, under a name of letters, digits and _: the force on every
 * mass, N, in the language of engine/README.md. The error of a text names its line. `bound` holds
 * the largest stiffness, N/m, and damping, N s/m, that the force gives a mass, 0 to 1e9 each; null
 * where they are unknown: then a simulation needs a fixed time step. At most 8 for a scene; their
 * order does not matter. */
limax_status limax_scene_add_script(limax_scene* scene, const char* name, const char* text,
                                    const limax_script_parameter* parameters, int32_t count,
                                    const double* bound);
/* The text of the effect `control`: assignments in the language of engine/README.md that set the
 * activation `a` of a voxel. Its inputs are the sensors below, the parameters, and the genes of
 * control of the robot. */
limax_status limax_scene_set_controller(limax_scene* scene, const char* text,
                                        const limax_script_parameter* parameters, int32_t count);
/* What the controller of a scene reads; all 0 without one. */
typedef struct limax_controller_needs {
    int32_t genes;    /* of control: those that a population must have at least */
    int32_t states;   /* of a voxel */
    int32_t messages; /* to each neighbour */
    int32_t inputs;   /* sensors, a vector counted as 3 */
} limax_controller_needs;
limax_status limax_scene_controller(const limax_scene* scene, limax_controller_needs* out);
/* The sensors that a controller may read, from 0; strings live as long as the library. */
typedef struct limax_sensor_info {
    const char* name;
    const char* unit;
    const char* note;
    int32_t components; /* 1 or 3 */
    int32_t measured;   /* whether noise and delay apply */
    double range;       /* what a controller's value of 1 is, in `unit` */
} limax_sensor_info;
int32_t limax_sensor_count(void);
limax_status limax_sensor_describe(int32_t sensor, limax_sensor_info* out);
/* The sensor and the component of an input of limax_controller_needs, from 0. */
limax_status limax_scene_input(const limax_scene* scene, int32_t input, int32_t* sensor,
                               int32_t* component);
/* Checks that every effect has one of those that it needs. */
limax_status limax_scene_check(const limax_scene* scene);

/* ---- simulation ------------------------------------------------------------------------------ */

typedef struct limax_simulation limax_simulation;

typedef enum limax_integrator {
    LIMAX_SYMPLECTIC_EULER = 0,
    LIMAX_LEAPFROG = 1,
    LIMAX_RK4 = 2 /* classical Runge-Kutta; on the CPU, for smooth scenes */
} limax_integrator;

typedef enum limax_precision {
    LIMAX_SINGLE = 0,
    LIMAX_COMPENSATED = 1, /* fp32, sums of position and velocity compensated */
    LIMAX_DOUBLE = 2
} limax_precision;

typedef enum limax_sharing { LIMAX_SHARING_MEAN = 0, LIMAX_SHARING_SUM = 1 } limax_sharing;

/* How the bound of an automatic step adds up the springs of a mass: one by one, or voxel by voxel.
 * The springs of a voxel cannot all stretch at the same time, so steps are 1.2 times as long. */
typedef enum limax_bound { LIMAX_BOUND_SPRINGS = 0, LIMAX_BOUND_VOXELS = 1 } limax_bound;

typedef enum limax_trace_kind {
    LIMAX_TRACE_CENTER_OF_MASS = 0, /* [sample][3], m */
    LIMAX_TRACE_POSITION = 1,       /* [sample][mass][3], m */
    LIMAX_TRACE_VELOCITY = 2,       /* [sample][mass][3], m/s, at the sample's own time */
    LIMAX_TRACE_CONTACT = 3,        /* [sample][1], share of the masses that touch a contact */
    LIMAX_TRACE_ENERGY = 4,         /* [sample][4], of the body: kinetic, elastic (springs and
                                     * contacts), gravitational (J); power of the muscles (W) */
    LIMAX_TRACE_STRAIN = 5, /* [sample][2]: mean and largest |r - L0| / L0 over the springs */
    /* of a scene with control, 0 where a voxel of the lattice is empty: */
    LIMAX_TRACE_ACTIVATION = 6, /* [sample][voxel], -1 to 1 */
    LIMAX_TRACE_SENSOR = 7, /* [sample][input][voxel] of the inputs that the controller reads, as
                             * it read them at the last tick: limax_scene_input() */
    /* [sample][9], J, blocks included: kinetic energy, that of springs, of contacts, and
     * gravitational energy; work since t = 0 of the muscles, of damping, of contacts' damping, of
     * friction, and of everything else, positive into the body; CPU only */
    LIMAX_TRACE_LEDGER = 8,
    LIMAX_TRACE_BLOCK = 9, /* [sample][block][7]: centre of each rigid block, m; quaternion w, x, y,
                            * z that turns its own axes into the world's */
    LIMAX_TRACE_KINDS = 10
} limax_trace_kind;

typedef struct limax_simulation_options {
    int32_t integrator; /* limax_integrator */
    int32_t precision;  /* limax_precision */
    int32_t sharing;    /* limax_sharing */
    int32_t
        record[10];  /* samples per second of each limax_trace_kind, 0 for none, at most 100000 */
    int32_t bound;   /* limax_bound; used when time_step is 0 */
    double duration; /* s from t = 0, when actuation starts, to the end; up to 1e6 */
    double settle;   /* s before t = 0, without actuation */
    /* s; 0 takes bound_fraction of each body's own bound, but no more than keeps every mass from
     * moving more than a tenth of an edge in a step at its largest initial or drop speed */
    double time_step;
    double bound_fraction; /* used when time_step is 0; 0.9 for `auto` */
    double time_step_most; /* s; cap used when time_step is 0, 1e-9 to 1; 0 for none */
    double edge;           /* h, m */
    double position[3];    /* m: where the lowest corner of the body's bounding box starts */
    double velocity[3];    /* m/s of every mass at the start */
    double max_speed;      /* m/s; a faster mass is divergence */
    double max_stretch;    /* times L0; a longer spring is divergence */
} limax_simulation_options;

/* Leapfrog, compensated, mean, auto at 0.9, h = 0.1 m, 1000 m/s, 10 L0, 5 s. */
void limax_simulation_defaults(limax_simulation_options* out);

typedef enum limax_robot_status {
    LIMAX_ROBOT_SKIPPED = 0, /* not in the mask */
    LIMAX_ROBOT_RUNNING = 1,
    LIMAX_ROBOT_DONE = 2,
    LIMAX_ROBOT_INVALID = 3, /* its body is not valid: reason is a limax_body_status */
    LIMAX_ROBOT_DIVERGED = 4 /* reason is a limax_divergence */
} limax_robot_status;

typedef enum limax_divergence {
    LIMAX_NOT_DIVERGED = 0,
    LIMAX_NONFINITE = 1,
    LIMAX_SPEED = 2,   /* a mass above max_speed */
    LIMAX_STRETCH = 3, /* a spring longer than max_stretch times L0 */
    LIMAX_CONTROL = 4  /* the controller gave a value that is not finite */
} limax_divergence;

typedef struct limax_outcome {
    int32_t status; /* limax_robot_status */
    int32_t reason;
    int64_t step;           /* steps done since the start of settling; where it diverged */
    int64_t steps;          /* steps in all */
    double time;            /* s since t = 0, negative while settling */
    double time_step;       /* s */
    double time_step_bound; /* s: the closed-form bound of this body, integrator and scene; NaN if
                               nothing moves */
    int32_t masses;
    int32_t springs;
    /* 1 if a mass moved more than a tenth of an edge in one step: the time step is coarse for this
     * motion. Checked every 64 steps and at the end only. */
    int32_t coarse;
    int32_t reserved;
    double mass;             /* kg */
    double center_start[3];  /* centre of mass at t = 0, m */
    double center_middle[3]; /* after half of the steps from t = 0 */
    double center_end[3];    /* at the end */
    /* Summaries of recorded traces, from t = 0; NaN where the trace is not recorded. */
    double path_length; /* horizontal length of the centre of mass's path, m (center_of_mass) */
    double height;      /* highest centre of mass above its place at t = 0, m (center_of_mass) */
    double contact;     /* mean share of masses in contact (contact) */
    double kinetic;     /* mean, J (energy) */
    double elastic;     /* mean, of springs and contacts, J (energy) */
    double muscle_work; /* integral of the muscles' positive power, J (energy) */
    double strain;      /* mean over samples of the mean strain (strain) */
    double strain_most; /* largest strain of any sample (strain) */
    /* The scene's first rigid block; NaN without one. */
    double block_start[3];    /* centre at t = 0, m */
    double block_middle[3];   /* after half of the steps from t = 0 */
    double block_end[3];      /* at the end */
    double block_velocity[3]; /* at the end, m/s */
    double block_upright; /* cosine of the angle between its own z axis and the world's, there */
} limax_outcome;

typedef struct limax_progress {
    int32_t done;     /* robots that have ended, whatever their status */
    int32_t robots;   /* robots in the mask */
    int32_t finished; /* 1 when nothing is left to do */
    int32_t
        interrupted; /* 1 when limax_interrupt() ended this call early; the state is consistent */
    double steps;    /* robot steps done so far */
    double steps_total;
    double spring_steps; /* springs times steps done so far */
} limax_progress;

/* Copies the bodies of `population` (checked or expressed) and prepares to simulate the robots
 * whose mask is not 0 (a null mask means all). Fixed time steps that do not divide the sample
 * interval are refused; the error names the nearest that does. */
limax_status limax_simulation_create(const limax_population* population,
                                     const limax_materials* materials, const limax_scene* scene,
                                     const limax_simulation_options* options, const uint8_t* mask,
                                     limax_device* device, limax_simulation** out);
void limax_simulation_free(limax_simulation* simulation);
/* Whole steps for about `seconds` of wall time, or at most `steps` steps of each robot if `steps`
 * is above 0. Results do not depend on how a run is divided. */
limax_status limax_simulation_advance(limax_simulation* simulation, double seconds, int64_t steps,
                                      limax_progress* out);
/* Whole steps of `count` simulations for about `seconds` in all, so that small ones share a GPU:
 * those on a GPU run at the same time, those on the CPU one after the other. Each may occur
 * once. `out` is [count]. */
limax_status limax_simulations_advance(limax_simulation* const* simulations, int32_t count,
                                       double seconds, limax_progress* out);
/* Begins with about `seconds` of steps of each simulation on its GPU and returns at once; the next
 * call that needs their results waits for them. On the CPU nothing happens until then. */
limax_status limax_simulations_begin(limax_simulation* const* simulations, int32_t count,
                                     double seconds);
/* The deepest contact of a body, or of a rigid block, with an obstacle at its start, if it is
 * deeper than a twentieth of an edge: what pushes masses out then throws the body. */
typedef struct limax_overlap {
    const char* subject; /* "robot 3", from 1, "the block", or "scene.block[2]" of several; empty if
                          * nothing overlaps */
    const char* obstacle; /* "scene.boxes[2]" */
    double depth;         /* m */
    int32_t robots;       /* that overlap something */
} limax_overlap;
/* Texts are valid until `_free`. */
limax_status limax_simulation_overlap(const limax_simulation* simulation, limax_overlap* out);
const limax_outcome* limax_simulation_outcomes(const limax_simulation* simulation); /* [robot] */
/* One robot's trace: samples so far, values per sample, and the data, [sample][width]; valid until
 * `_free`. Null data and 0 samples for a robot that was not simulated; LIMAX_INVALID_ARGUMENT if
 * the kind is not recorded. */
limax_status limax_simulation_trace(const limax_simulation* simulation, int32_t robot, int32_t kind,
                                    const double** data, int64_t* samples, int64_t* width);
/* Site x + (nx + 1) (y + (ny + 1) z) of each mass, [mass], of a simulated robot, until `_free`. */
limax_status limax_simulation_sites(const limax_simulation* simulation, int32_t robot,
                                    const int32_t** sites);
/* Sets positions and velocities of the masses of one robot, [mass][3] each, m and m/s, before its
 * first step; either may be null. A mass that the scene holds gets no velocity. */
limax_status limax_simulation_place(limax_simulation* simulation, int32_t robot,
                                    const double* positions, const double* velocities);
/* Current state of one robot, world coordinates, each [mass][3]; either may be null. Robots are
 * prepared when they are first stepped, placed or asked for their state: from then on their outcome
 * has mass, bound and time step. */
limax_status limax_simulation_state(const limax_simulation* simulation, int32_t robot,
                                    double* positions, double* velocities);

enum { LIMAX_BLOCK_STATE = 13 };
/* Current state of rigid block `which` of one robot, from 0 in the order of adding,
 * [LIMAX_BLOCK_STATE]: its centre (m, in the world), the quaternion w, x, y, z that turns its own
 * axes into the world's, velocity (m/s) and angular velocity (rad/s, in the world).
 * LIMAX_INVALID_ARGUMENT if the scene has no such block. */
limax_status limax_simulation_block(const limax_simulation* simulation, int32_t robot,
                                    int32_t which, double* out);

/* Sets state s[`state`] of a robot's controller, [voxel] of the lattice, for the next tick. Only on
 * the CPU. LIMAX_INVALID_ARGUMENT for a controller that sets no such state. */
limax_status limax_simulation_set_state(limax_simulation* simulation, int32_t robot, int32_t state,
                                        const double* values);

/* JSON object: what runs the steps of this simulation: `device`, and for cpu `passes`, for cuda
 * `path`, `effects`, `precision`, `origin` of the kernel (ahead of time, cached, compiled) and the
 * `seconds` that took, `form` (made for many robots of a multiprocessor, for a single one, or for
 * any lattice), `made_for` if it was made for more effects, `architecture`, `threads`, `registers`,
 * `spilled` (bytes), `shared_bytes`, `blocks_of_multiprocessor`, `instructions`. Valid until the
 * next call for this simulation. */
limax_status limax_simulation_describe(limax_simulation* simulation, const char** out);

/* ---- scripted forces ------------------------------------------------------------------------ */

enum { LIMAX_MOST_SCRIPTS = 8 };
typedef struct limax_script_slope {
    const char* name;        /* alive as long as the scene */
    int32_t bounded;         /* whether the scene states its bound */
    double stated_stiffness; /* N/m */
    double stated_damping;   /* N s/m */
    double stiffness;        /* largest |df/dx| along an axis over the masses, N/m */
    double damping;          /* largest |df/dv|, N s/m */
} limax_script_slope;
/* How steep each scripted force of a scene is at the masses of one robot, by central differences:
 * `positions` and `velocities` are [mass][3], m in the world and m/s, `time` is in s, `out` is
 * [LIMAX_MOST_SCRIPTS]. Of the options edge and sharing count. */
limax_status limax_script_slopes(limax_population* population, int32_t robot,
                                 const limax_materials* materials, const limax_scene* scene,
                                 const limax_simulation_options* options, const double* positions,
                                 const double* velocities, double time, limax_script_slope* out,
                                 int32_t* count);

/* ---- natural modes --------------------------------------------------------------------------- */

typedef struct limax_mode {
    double frequency;     /* Hz, without damping */
    double damping_ratio; /* 1 */
    /* Largest displacement of a mass in this mode if the muscles pulled slowly, m: by the sine and
     * by the cosine of their drive. 0 in a scene without actuation. */
    double sine, cosine;
} limax_mode;

/* Small vibrations of one robot about a pose at rest, the lowest frequencies first. `positions` is
 * that pose, [mass][3] in the world, m, whose springs and touching contacts act; null for the
 * undeformed body without contacts. Masses that the scene holds stay where they are. `modes` is
 * [count] and `shapes` [count][mass][3], displacements of which the largest of a mode is 1.
 * `found` is how many there are, at most `count`; `rigid`, how many independent motions meet no
 * restoring force and are left out: 6 of a free body in one piece. Refuses a pose that is not
 * stable. 6 modes of 125 voxels take 20 ms, of 1000 voxels 1 s. Of the options edge and sharing
 * count. */
limax_status limax_modes(limax_population* population, int32_t robot,
                         const limax_materials* materials, const limax_scene* scene,
                         const limax_simulation_options* options, const double* positions,
                         int32_t count, limax_mode* modes, double* shapes, int32_t* found,
                         int32_t* rigid);

/* ---- cdef ends ---- */
#pragma GCC visibility pop
#ifdef __cplusplus
}
#endif

#endif
