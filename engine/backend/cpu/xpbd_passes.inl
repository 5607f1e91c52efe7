// xpbd_passes.inl: the loops of XPBD, a part of passes.inl. Springs are processed in groups in
// which no two share a mass, so that the order within a group does not matter: one half-direction
// after the other, first its springs that start at even sites along z, then those at odd ones
// (along y for a half-direction without z, along x for one without y and z).

// The axis along which a half-direction is cut into halves.
LIMAX_LAW constexpr int halving_axis(const direction& d) { return d.z ? 2 : (d.y ? 1 : 0); }

// The forces of one half of the springs of direction `d` at the end of the step, N, into transfer,
// and 0 for the others.
template <class R, bool damped, bool actuated>
void sweep_half(const spring_arrays<R>& robot, const sweep_arrays<R>& step,
                const actuation::moment<R>& moment, int d, int half) {
    // e is the spring at t_n, p the one predicted by the velocities so far
    const R *x = robot.position[0], *y = robot.position[1], *z = robot.position[2];
    const R *u = step.velocity[0], *v = step.velocity[1], *w = step.velocity[2];
    R *tx = robot.transfer[0], *ty = robot.transfer[1], *tz = robot.transfer[2];
    const R* odd = step.odd[halving_axis(direction_at(d))];
    const int64_t far = robot.step[d], used = robot.used[d];
    const R* stiffness = step.stiffness + d * robot.count;
    const R* damping_constant = damped ? step.damping + d * robot.count : nullptr;
    const float* sine = actuated ? robot.sine + d * robot.count : nullptr;
    const float* cosine = actuated ? robot.cosine + d * robot.count : nullptr;
    const R rest = robot.rest[d], dt = step.dt, wanted = R(half);
    LIMAX_LOOP
    for (int64_t i = 0; i < used; ++i) {
        const separation<R> rate{u[i + far] - u[i], v[i + far] - v[i], w[i + far] - w[i]};
        const separation<R> e{x[i + far] - x[i], y[i + far] - y[i], z[i + far] - z[i]};
        const separation<R> p{fma(dt, rate.x, e.x), fma(dt, rate.y, e.y), fma(dt, rate.z, e.z)};
        const distance<R> predicted = spring_length(p);
        spring_state<R> spring{};
        spring.length = predicted.length;
        spring.stiffness = stiffness[i];
        spring.rest = rest;
        if constexpr (actuated) {
            spring.sine = R(sine[i]);
            spring.cosine = R(cosine[i]);
            spring.rest = actuation::rest(moment, spring);
        }
        spring_force<R> force = springs::pair(spring, {});
        if constexpr (damped) {
            spring.damping = damping_constant[i];
            spring.rate = dot(rate, p) * predicted.inverse;
            force = damping::pair(spring, force);
        }
        const R pull = tension(force, predicted.length);
        const R scale = odd[i] == wanted ? pull * spring_length(e).inverse : R(0);
        tx[i] = scale * e.x;
        ty[i] = scale * e.y;
        tz[i] = scale * e.z;
    }
}

// Adds the forces in transfer to both ends of their springs, and what they do there in dt.
template <class R>
void give(const spring_arrays<R>& robot, const sweep_arrays<R>& step, int64_t far) {
    R *fx = robot.force[0], *fy = robot.force[1], *fz = robot.force[2];
    R *u = step.velocity[0], *v = step.velocity[1], *w = step.velocity[2];
    const R *tx = robot.transfer[0], *ty = robot.transfer[1], *tz = robot.transfer[2];
    const R* inverse_mass = step.inverse_mass;
    const R dt = step.dt;
    LIMAX_LOOP
    for (int64_t i = 0; i < robot.count; ++i) {
        const R x = tx[i] - tx[i - far], y = ty[i] - ty[i - far], z = tz[i] - tz[i - far];
        const R share = dt * inverse_mass[i];
        fx[i] += x;
        fy[i] += y;
        fz[i] += z;
        u[i] = fma(share, x, u[i]);
        v[i] = fma(share, y, v[i]);
        w[i] = fma(share, z, w[i]);
    }
}

template <class R, bool damped, bool actuated>
void sweep(const spring_arrays<R>& robot, const sweep_arrays<R>& step,
           const actuation::moment<R>& moment) {
    for (int d = 0; d < direction_count; ++d) {
        // no spring starts there
        for (R* transfer : robot.transfer)
            for (int64_t i = robot.used[d]; i < robot.count; ++i) transfer[i] = R(0);
        for (int half = 0; half < step.halves[halving_axis(direction_at(d))]; ++half) {
            sweep_half<R, damped, actuated>(robot, step, moment, d, half);
            give(robot, step, robot.step[d]);
        }
    }
}

// ---- contacts ----

template <class R, class E>
void press(const mass_arrays<R>& shared, const void* block, R h) {
    const auto params = *static_cast<const typename E::template params<R>*>(block);
    const mass_arrays<R> robot = shared;
    R *wx = robot.next_velocity[0], *wy = robot.next_velocity[1], *wz = robot.next_velocity[2];
    R* pushes = robot.force[0];
    LIMAX_LOOP
    for (int64_t i = 0; i < robot.count; ++i) {
        node_state<R> state = node_at(robot, i);
        state.velocity = {wx[i], wy[i], wz[i]};
        // the surface as it is here, seen from where the mass will be
        auto point = E::surface(params, state.position);
        point.depth = fma(-h, along(point.normal, state.velocity), point.depth);
        const R damping = params.damping * state.root_mass;
        const R push = push_at(params, point, state) *
                       reaction(params.stiffness, damping, state.inverse_mass, h);
        add_push(point.normal, h * state.inverse_mass * push, state.velocity);
        pushes[i] = push;
        wx[i] = state.velocity.x;
        wy[i] = state.velocity.y;
        wz[i] = state.velocity.z;
    }
}

template <class R, class E>
void pressed_slip(const mass_arrays<R>& shared, site_range touching, const void* block,
                  const void* friction_block, R h) {
    const auto params = *static_cast<const typename E::template params<R>*>(block);
    const auto coefficients = *static_cast<const friction::params<R>*>(friction_block);
    const mass_arrays<R> robot = shared;
    R *wx = robot.next_velocity[0], *wy = robot.next_velocity[1], *wz = robot.next_velocity[2];
    const R* pushes = robot.force[0];
    LIMAX_LOOP
    for (int64_t i = touching.first; i < touching.end; ++i) {
        const node_state<R> state = node_at(robot, i);
        const auto point = E::surface(params, state.position);
        const vector<R> after =
            friction::slip(coefficients, point.normal, pushes[i], state.inverse_mass,
                           velocity_at(robot, i), vector<R>{wx[i], wy[i], wz[i]}, h);
        wx[i] = after.x;
        wy[i] = after.y;
        wz[i] = after.z;
    }
}
