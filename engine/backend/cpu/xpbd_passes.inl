// xpbd_passes.inl: the loops of XPBD, a part of passes.inl. Springs meet in groups of which no two
// share a mass, so that the order within a group changes nothing and each is computed once: half-
// direction by half-direction, and within one layer by layer along z, from the lowest, or, where
// it stays within a layer, those that start at even places along y (or x) before the others.

// The forces of springs of direction `d` at the end of the step, N, into transfer: of those from
// `begin` to `end`, or of those among them that lie in `half` (0: even, 1: odd).
template <class R, bool damped, bool actuated, bool halved>
void sweep_group(const spring_arrays<R>& robot, const sweep_arrays<R>& step,
                 const actuation::moment<R>& moment, int d, int64_t begin, int64_t end, int half) {
    const R least_squared = R(1e-20);  // as in pair(), m^2
    const R *x = robot.position[0], *y = robot.position[1], *z = robot.position[2];
    const R *u = step.velocity[0], *v = step.velocity[1], *w = step.velocity[2];
    R *tx = robot.transfer[0], *ty = robot.transfer[1], *tz = robot.transfer[2];
    const R *inverse_mass = step.inverse_mass, *odd = step.odd[direction_at(d).y != 0];
    const int64_t far = robot.step[d];
    const float* stiffness = robot.stiffness + d * robot.count;
    const float* damping_constant = damped ? robot.damping + d * robot.count : nullptr;
    const float* sine = actuated ? robot.sine + d * robot.count : nullptr;
    const float* cosine = actuated ? robot.cosine + d * robot.count : nullptr;
    const R rest = robot.rest[d], dt = step.dt, wanted = R(half);
    LIMAX_LOOP
    for (int64_t i = begin; i < end; ++i) {
        const R wx = u[i + far] - u[i], wy = v[i + far] - v[i], wz = w[i + far] - w[i];
        const R ex = fma(dt, wx, x[i + far] - x[i]), ey = fma(dt, wy, y[i + far] - y[i]),
                ez = fma(dt, wz, z[i + far] - z[i]);
        const R squared = fma(ex, ex, fma(ey, ey, fma(ez, ez, least_squared)));
        const R inverse = inverse_length(squared);
        spring_state<R> spring{};
        spring.length = squared * inverse;
        spring.stiffness = R(stiffness[i]);
        spring.rest = rest;
        if constexpr (actuated) {
            spring.sine = R(sine[i]);
            spring.cosine = R(cosine[i]);
            spring.rest = actuation::rest(moment, spring);
        }
        R tension = springs::pair(spring, R(0));
        if constexpr (damped) {
            spring.damping = R(damping_constant[i]);
            spring.rate = fma(wx, ex, fma(wy, ey, wz * ez)) * inverse;
            tension = damping::pair(spring, tension);
        }
        tension *=
            reaction(spring.stiffness, spring.damping, inverse_mass[i] + inverse_mass[i + far], dt);
        R scale = tension * inverse;
        if constexpr (halved) scale = odd[i] == wanted ? scale : R(0);
        tx[i] = scale * ex;
        ty[i] = scale * ey;
        tz[i] = scale * ez;
    }
}

// Adds the forces in transfer to one end of their springs, and what they do there in dt; `sign` is
// 1 at the near end and -1 at the far one.
template <class R>
void give(R* sum, R* velocity, const R* inverse_mass, const R* transfer, R dt, R sign,
          int64_t begin, int64_t end) {
    const R share = sign * dt;
    LIMAX_LOOP
    for (int64_t i = begin; i < end; ++i) {
        sum[i] = fma(sign, transfer[i], sum[i]);
        velocity[i] = fma(share * inverse_mass[i], transfer[i], velocity[i]);
    }
}

template <class R, bool damped, bool actuated>
void sweep(const spring_arrays<R>& robot, const sweep_arrays<R>& step,
           const actuation::moment<R>& moment) {
    for (int d = 0; d < direction_count; ++d) {
        const bool across_layers = direction_at(d).z != 0;
        const int64_t far = robot.step[d], near = step.sites - far;
        const int64_t group = across_layers ? step.layer : near;
        for (int64_t begin = 0; begin < near; begin += group)
            for (int half = 0; half < (across_layers ? 1 : 2); ++half) {
                const int64_t end = begin + group < near ? begin + group : near;
                if (across_layers)
                    sweep_group<R, damped, actuated, false>(robot, step, moment, d, begin, end, 0);
                else
                    sweep_group<R, damped, actuated, true>(robot, step, moment, d, begin, end,
                                                           half);
                for (int axis = 0; axis < 3; ++axis) {
                    R *sum = robot.force[axis], *velocity = step.velocity[axis];
                    const R* transfer = robot.transfer[axis];
                    give(sum, velocity, step.inverse_mass, transfer, step.dt, R(1), begin, end);
                    give(sum + far, velocity + far, step.inverse_mass + far, transfer, step.dt,
                         R(-1), begin, end);
                }
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
        const R damping = contact_damping(params.stiffness, params.damping_ratio, state.mass);
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
void pressed_slip(const mass_arrays<R>& shared, const void* block, const void* friction_block,
                  R h) {
    const auto params = *static_cast<const typename E::template params<R>*>(block);
    const auto coefficients = *static_cast<const friction::params<R>*>(friction_block);
    const mass_arrays<R> robot = shared;
    R *wx = robot.next_velocity[0], *wy = robot.next_velocity[1], *wz = robot.next_velocity[2];
    const R* pushes = robot.force[0];
    LIMAX_LOOP
    for (int64_t i = 0; i < robot.count; ++i) {
        const node_state<R> state = node_at(robot, i);
        const auto point = E::surface(params, state.position);
        const vector<R> after =
            friction::slip(coefficients, point.normal, pushes[i], state.inverse_mass,
                           vector<R>{wx[i], wy[i], wz[i]}, h);
        wx[i] = after.x;
        wy[i] = after.y;
        wz[i] = after.z;
    }
}
