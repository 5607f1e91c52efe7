// passes.inl: the loops of the CPU, included once per instruction set by a file that names it in
// LIMAX_ISA. Every marked loop has unit stride and no branch, so that the compiler vectorises it;
// tests/engine reads its report. The arithmetic is the laws'.
#include <utility>
#if defined(__AVX2__)
#include <immintrin.h>
#endif

#include "backend/cpu/passes.h"
#include "genome/express_pass.h"
#include "physics/integrator.h"
#include "physics/separation.h"

#if defined(__clang__)
#define LIMAX_LOOP _Pragma("clang loop vectorize(assume_safety)")
#define LIMAX_FEW_POINTERS
#else
#define LIMAX_LOOP _Pragma("GCC ivdep")
// A function that reads more columns than there are registers is 8 % slower if each column gets a
// pointer of its own.
#define LIMAX_FEW_POINTERS [[gnu::optimize("no-ivopts")]]
#endif

namespace limax::cpu::LIMAX_ISA {

namespace {

using namespace effects;

#include "backend/cpu/cells.inl"

// ---- masses ----

template <class R>
LIMAX_LAW node_state<R> node_at(const mass_arrays<R>& robot, int64_t i) {
    return {{robot.position[0][i], robot.position[1][i], robot.position[2][i]},
            {robot.predicted[0][i], robot.predicted[1][i], robot.predicted[2][i]},
            robot.mass[i],
            robot.inverse_mass[i]};
}

// Before the kick.
template <class R>
LIMAX_LAW vector<R> velocity_at(const mass_arrays<R>& robot, int64_t i) {
    return {robot.velocity[0][i], robot.velocity[1][i], robot.velocity[2][i]};
}

// Sites at once, between which a contact looks whether any mass touches.
inline constexpr int64_t touch_block = 2 * site_block;

template <class R, class E>
site_range node(const mass_arrays<R>& shared, const void* block) {
    const auto params = *static_cast<const typename E::template params<R>*>(block);
    const mass_arrays<R> robot = shared;
    R *fx = robot.force[0], *fy = robot.force[1], *fz = robot.force[2];
    const int64_t step = is_contact<E> ? touch_block : robot.count;
    site_range touching{robot.count, 0};
    for (int64_t first = 0; first < robot.count; first += step) {
        const int64_t end = first + step < robot.count ? first + step : robot.count;
        int32_t touched = 0;
        LIMAX_LOOP
        for (int64_t i = first; i < end; ++i) {
            const node_state<R> state = node_at(robot, i);
            vector<R> force{fx[i], fy[i], fz[i]};
            add_force<E>(params, state, force);
            fx[i] = force.x;
            fy[i] = force.y;
            fz[i] = force.z;
            if constexpr (is_contact<E>) touched += E::surface(params, state.position).depth > R(0);
        }
        if (!touched) continue;
        if (touching.first > first) touching.first = first;
        touching.end = end;
    }
    return touching;
}

// One operation on a block of registers.
template <scripted::operation what, class R>
void operate(int count, const R* a, const R* b, const R* c, R* result) {
    LIMAX_LOOP
    for (int i = 0; i < count; ++i) result[i] = scripted::apply<what>(a[i], b[i], c[i]);
}

template <class R>
using operate_pass = void (*)(int, const R*, const R*, const R*, R*);
template <class R>
struct operate_passes {
    operate_pass<R> of[scripted::operation_count];
};
template <class R, int... index>
constexpr operate_passes<R> make_operate_passes(std::integer_sequence<int, index...>) {
    return {{operate<scripted::operation(index), R>...}};
}
template <class R>
constexpr operate_passes<R> operations =
    make_operate_passes<R>(std::make_integer_sequence<int, scripted::operation_count>{});

template <class R>
void scripted_force(const mass_arrays<R>& shared, const scripted_law<R>& law) {
    const mass_arrays<R> robot = shared;
    const auto at = [&](int index) { return law.registers + int64_t(index) * scripted_block; };
    for (int k = 0; k < law.constant_count; ++k)
        for (int i = 0; i < scripted_block; ++i)
            at(scripted::force_inputs + k)[i] = R(law.constants[k]);
    for (int i = 0; i < scripted_block; ++i) at(scripted::input_time)[i] = R(law.time);
    for (int64_t first = 0; first < robot.count; first += scripted_block) {
        const int count =
            int(robot.count - first < scripted_block ? robot.count - first : scripted_block);
        for (int axis = 0; axis < 3; ++axis) {
            const R *x = robot.position[axis] + first, *p = robot.predicted[axis] + first;
            R *place = at(scripted::input_position + axis),
              *velocity = at(scripted::input_velocity + axis);
            const R origin = R(law.origin[axis]);
            LIMAX_LOOP
            for (int i = 0; i < count; ++i) {
                place[i] = origin + x[i];
                velocity[i] = p[i];
            }
        }
        const R* mass = robot.mass + first;
        R* input_masses = at(scripted::input_mass);
        LIMAX_LOOP
        for (int i = 0; i < count; ++i) input_masses[i] = mass[i];

        R* result = at(scripted::force_inputs + law.constant_count);
        for (int k = 0; k < law.instruction_count; ++k, result += scripted_block) {
            const scripted::instruction step = law.instructions[k];
            operations<R>.of[int(step.what)](count, at(step.a), at(step.b), at(step.c), result);
        }
        // a site without a mass has no force, whatever the law computes there
        for (int axis = 0; axis < 3; ++axis) {
            const R* by_law = at(law.force[axis]);
            R* force = robot.force[axis] + first;
            LIMAX_LOOP
            for (int i = 0; i < count; ++i) force[i] += mass[i] > R(0) ? by_law[i] : R(0);
        }
    }
}

// A layer for a block of voxels: for as many as fit a few vectors, one hidden unit after the other.
// What lies beyond `count` is computed in vain.
template <class R>
void evaluate_layer(const scripted::layer& own, const float* genes, int count, const R* registers,
                    R* result) {
    const int inputs = int(own.inputs.size()), outputs = own.outputs;
    const int row = scripted::row_of_layer(inputs, outputs);
    const float* const weights = genes + own.first;
    const float* const c = weights + own.hidden * row;
    const float* const b = c + own.hidden;
    using V = lanes<R>;
    constexpr int vectors = site_block / V::count;
    for (int first = 0; first < count; first += site_block) {
        R* const out = result + first;
        for (int o = 0; o < outputs; ++o)
            for (int v = 0; v < vectors; ++v)
                store(out + o * scripted_block + v * V::count, V(double(b[o])));
        for (int unit = 0; unit < own.hidden; ++unit) {
            V sum[vectors];
            for (V& each : sum) each = V(double(c[unit]));
            for (int k = 0; k < inputs; ++k) {
                const V weight(double(weights[unit * row + k]));
                const R* in =
                    registers + int64_t(own.inputs[std::size_t(k)]) * scripted_block + first;
                for (int v = 0; v < vectors; ++v)
                    sum[v] = fma(weight, load<R>(in + v * V::count), sum[v]);
            }
            R z[site_block];
            for (int v = 0; v < vectors; ++v) store(z + v * V::count, sum[v]);
            LIMAX_LOOP
            for (int i = 0; i < site_block; ++i) z[i] = tangent_of_controller(z[i]);
            for (int o = 0; o < outputs; ++o) {
                const V weight(double(weights[unit * row + inputs + o]));
                for (int v = 0; v < vectors; ++v) {
                    R* const at = out + o * scripted_block + v * V::count;
                    store(at, fma(weight, load<R>(z + v * V::count), load<R>(at)));
                }
            }
        }
    }
}

// What voxels sense at their corners, as inputs of a controller.
template <class R>
void sense(const mass_arrays<R>& shared, const voxel_senses<R>& of) {
    const mass_arrays<R> robot = shared;
    for (int i = 0; i < of.count; ++i) {
        R in[sensors::gravity];
        sensors::sense_voxel<R>(
            of.edge, of.per_weight[i],
            [&](int c) {
                const int64_t site = of.lowest[i] + of.corner[c];
                return sensors::corner<R>{
                    {robot.position[0][site], robot.position[1][site], robot.position[2][site]},
                    {robot.predicted[0][site], robot.predicted[1][site], robot.predicted[2][site]},
                    of.push ? of.push[site] : R(0),
                    of.push && of.push[site] > R(0)};
            },
            in);
        for (int k = 0; k < sensors::gravity; ++k) of.registers[k * scripted_block + i] = in[k];
    }
}

template <class R>
void controller(const controller_law<R>& law, int count) {
    using scripted::operation;
    const scripted::program& program = law.program;
    const auto at = [&](int index) { return law.registers + int64_t(index) * scripted_block; };
    R* result = at(program.inputs);
    for (const double constant : program.constants) {
        for (int i = 0; i < count; ++i) result[i] = R(constant);
        result += scripted_block;
    }
    for (const scripted::instruction& step : program.instructions) {
        if (step.what == operation::gene)
            for (int i = 0; i < count; ++i) result[i] = R(law.genes[step.a]);
        else if (step.what == operation::layer)
            evaluate_layer(program.layers[std::size_t(step.a)], law.genes, count, law.registers,
                           result);
        else if (step.what != operation::of_layer)
            operations<R>.of[int(step.what)](count, at(step.a), at(step.b), at(step.c), result);
        result += scripted_block;
    }
}

// The mean of a column over the four corners of a face.
template <class R>
LIMAX_LAW R mean_of_corners(const R* column, int64_t i, int64_t a, int64_t b) {
    return R(0.25) * ((column[i] + column[i + a]) + (column[i + b] + column[i + a + b]));
}

// Faces are computed once each, as springs are, and their impulses gathered by their corners. After
// the kick the forces' memory is free: it holds what each corner of a face takes, N s.
template <class R, class E>
void face(const mass_arrays<R>& shared, const void* block, R h) {
    const auto params = *static_cast<const typename E::template params<R>*>(block);
    const mass_arrays<R> robot = shared;
    const R *x = robot.position[0], *y = robot.position[1], *z = robot.position[2];
    const R *px = robot.predicted[0], *py = robot.predicted[1], *pz = robot.predicted[2];
    R *wx = robot.next_velocity[0], *wy = robot.next_velocity[1], *wz = robot.next_velocity[2];
    R *tx = robot.force[0], *ty = robot.force[1], *tz = robot.force[2];
    const R* inverse_mass = robot.inverse_mass;
    for (int axis = 0; axis < 3; ++axis) {
        const int64_t a = robot.step[(axis + 1) % 3], b = robot.step[(axis + 2) % 3], c = a + b;
        const float* lightest = robot.faces + axis * robot.count;
        LIMAX_LOOP
        for (int64_t i = 0; i < robot.count; ++i) {
            const R d1x = x[i + c] - x[i], d1y = y[i + c] - y[i], d1z = z[i + c] - z[i];
            const R d2x = x[i + b] - x[i + a], d2y = y[i + b] - y[i + a], d2z = z[i + b] - z[i + a];
            face_state<R> state;
            state.area = {R(0.5) * (d1y * d2z - d1z * d2y), R(0.5) * (d1z * d2x - d1x * d2z),
                          R(0.5) * (d1x * d2y - d1y * d2x)};
            state.velocity = {mean_of_corners(px, i, a, b), mean_of_corners(py, i, a, b),
                              mean_of_corners(pz, i, a, b)};
            state.after = {mean_of_corners(wx, i, a, b), mean_of_corners(wy, i, a, b),
                           mean_of_corners(wz, i, a, b)};
            state.mass = R(lightest[i]);
            const vector<R> impulse = E::face(params, state, h);
            tx[i] = R(0.25) * impulse.x;
            ty[i] = R(0.25) * impulse.y;
            tz[i] = R(0.25) * impulse.z;
        }
        LIMAX_LOOP
        for (int64_t i = 0; i < robot.count; ++i) {
            const R inverse = inverse_mass[i];
            wx[i] = fma(inverse, (tx[i] + tx[i - a]) + (tx[i - b] + tx[i - c]), wx[i]);
            wy[i] = fma(inverse, (ty[i] + ty[i - a]) + (ty[i - b] + ty[i - c]), wy[i]);
            wz[i] = fma(inverse, (tz[i] + tz[i - a]) + (tz[i - b] + tz[i - c]), wz[i]);
        }
    }
}

// The contact is found again, from the same numbers and so with the same bits.
template <class R, class E>
void slip(const mass_arrays<R>& shared, site_range touching, const void* block,
          const void* friction_block, const patch_list<R>& patches, R h) {
    const auto params = *static_cast<const typename E::template params<R>*>(block);
    const auto coefficients = *static_cast<const friction::params<R>*>(friction_block);
    const mass_arrays<R> robot = shared;
    R *wx = robot.next_velocity[0], *wy = robot.next_velocity[1], *wz = robot.next_velocity[2];
    const auto slide = [&](int64_t i, const friction::params<R>& own) {
        const vector<R> after =
            after_friction<E, friction>(params, own, node_at(robot, i), velocity_at(robot, i),
                                        vector<R>{wx[i], wy[i], wz[i]}, h);
        wx[i] = after.x;
        wy[i] = after.y;
        wz[i] = after.z;
    };
    for (int64_t i = touching.first; i < touching.end && !patches.empty(); ++i) {
        friction::params<R> own = coefficients;
        for (const auto& patch : patches)
            own = friction::scaled(own, effects::patches::grip(patch, node_at(robot, i).position));
        slide(i, own);
    }
    if (!patches.empty()) return;
    LIMAX_LOOP
    for (int64_t i = touching.first; i < touching.end; ++i) slide(i, coefficients);
}

template <class R, bool compensated>
void kick(const mass_arrays<R>& robot, R h) {
    const R* inverse_mass = robot.inverse_mass;
    for (int axis = 0; axis < 3; ++axis) {
        const R *u = robot.velocity[axis], *force = robot.force[axis];
        R *w = robot.next_velocity[axis], *lost = robot.lost_velocity[axis];
        LIMAX_LOOP
        for (int64_t i = 0; i < robot.count; ++i) {
            R carried = compensated ? lost[i] : R(0);
            w[i] = limax::kick<compensated>(u[i], force[i], inverse_mass[i], h, carried);
            if constexpr (compensated) lost[i] = carried;
        }
    }
}

template <class R, bool compensated, bool predicted>
void drift(const mass_arrays<R>& robot, R dt, R share) {
    for (int axis = 0; axis < 3; ++axis) {
        const R *u = robot.velocity[axis], *w = robot.next_velocity[axis];
        R *x = robot.position[axis], *p = robot.predicted[axis], *lost = robot.lost_position[axis];
        LIMAX_LOOP
        for (int64_t i = 0; i < robot.count; ++i) {
            R carried = compensated ? lost[i] : R(0);
            x[i] = limax::drift<compensated>(x[i], w[i], dt, carried);
            if constexpr (compensated) lost[i] = carried;
            if constexpr (predicted) p[i] = predict(u[i], w[i], share);
        }
    }
}

#include "backend/cpu/runge_kutta_passes.inl"

// ---- limits ----

template <class R>
limit_breaks limit_masses(const mass_arrays<R>& robot, R max_speed, R coarse) {
    const R *x = robot.position[0], *y = robot.position[1], *z = robot.position[2];
    const R *u = robot.velocity[0], *v = robot.velocity[1], *w = robot.velocity[2];
    const R infinite = R(__builtin_inf());
    int32_t nonfinite = 0, fast = 0, far = 0;
    LIMAX_LOOP
    for (int64_t i = 0; i < robot.count; ++i) {
        const R reach = absolute(x[i]) + absolute(y[i]) + absolute(z[i]);
        const R speed = square_root(fma(u[i], u[i], fma(v[i], v[i], w[i] * w[i])));
        nonfinite += !(reach < infinite) || !(speed < infinite);
        fast += !(speed <= max_speed);
        far += speed > coarse;
    }
    return {nonfinite, fast, far};
}

template <class R>
int32_t limit_springs(const spring_arrays<R>& robot, R max_stretch) {
    const R *x = robot.position[0], *y = robot.position[1], *z = robot.position[2];
    int32_t stretched = 0;
    for (int d = 0; d < direction_count; ++d) {
        const int64_t far = robot.step[d];
        const float* stiffness = robot.stiffness + d * robot.count;
        const R longest = max_stretch * robot.rest[d], most = longest * longest;
        LIMAX_LOOP
        for (int64_t i = 0; i < robot.used[d]; ++i) {
            const R ex = x[i + far] - x[i], ey = y[i + far] - y[i], ez = z[i + far] - z[i];
            const R squared = fma(ex, ex, fma(ey, ey, ez * ez));
            stretched += (stiffness[i] > 0.0f) & !(squared <= most);
        }
    }
    return stretched;
}

// ---- tables ----

template <class R>
constexpr step_passes<R> make_passes() {
    step_passes<R> passes{};
    passes.pair[0] = pair<R, false, no_drive>;
    passes.pair[1] = pair<R, true, no_drive>;
    passes.pair[2] = pair<R, false, sine_drive>;
    passes.pair[3] = pair<R, true, sine_drive>;
    passes.pair[4] = pair<R, false, controlled_drive>;
    passes.pair[5] = pair<R, true, controlled_drive>;
    for_each([&]<class E>(E) {
        if constexpr (pushes_masses<E>) passes.node[index_of<E>] = node<R, E>;
        if constexpr (is_contact<E>) passes.slip[index_of<E>] = slip<R, E>;
        if constexpr (E::hooks & hook_face) passes.face[index_of<E>] = face<R, E>;
    });
    passes.scripted = scripted_force<R>;
    passes.controller = controller<R>;
    passes.sense = sense<R>;
    passes.kick[0] = kick<R, false>;
    passes.kick[1] = kick<R, true>;
    passes.drift[0][0] = drift<R, false, false>;
    passes.drift[0][1] = drift<R, false, true>;
    passes.drift[1][0] = drift<R, true, false>;
    passes.drift[1][1] = drift<R, true, true>;
    passes.stage[0][0] = stage<R, false, false>;
    passes.stage[0][1] = stage<R, false, true>;
    passes.stage[1][0] = stage<R, true, false>;
    passes.stage[1][1] = stage<R, true, true>;
    passes.stage_end[0] = stage_end<R, false>;
    passes.stage_end[1] = stage_end<R, true>;
    passes.limit_masses = limit_masses<R>;
    passes.limit_springs = limit_springs<R>;
    return passes;
}

}  // namespace

extern const pass_table table;
const pass_table table = {LIMAX_ISA_NAME, make_passes<float>(), make_passes<double>(),
                          limax::LIMAX_ISA::express_robot};

}  // namespace limax::cpu::LIMAX_ISA
