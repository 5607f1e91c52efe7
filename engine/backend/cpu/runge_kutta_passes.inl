// runge_kutta_passes.inl: the loops of the classical Runge-Kutta method, a part of passes.inl.

template <class R, bool compensated, bool first>
void stage(const mass_arrays<R>& start, const stage_arrays<R>& between, R weight, R h) {
    const R* inverse_mass = start.inverse_mass;
    for (int axis = 0; axis < 3; ++axis) {
        const R *x = start.position[axis], *v = start.velocity[axis], *force = start.force[axis];
        const R *lost_x = start.lost_position[axis], *lost_v = start.lost_velocity[axis];
        R *to_x = between.position[axis], *to_v = between.velocity[axis];
        R *slope_x = between.position_slope[axis], *slope_v = between.velocity_slope[axis];
        LIMAX_LOOP
        for (int64_t i = 0; i < start.count; ++i) {
            const R velocity = first ? v[i] : to_v[i];
            const R acceleration = force[i] * inverse_mass[i];
            slope_x[i] = first ? velocity : fma(weight, velocity, slope_x[i]);
            slope_v[i] = first ? acceleration : fma(weight, acceleration, slope_v[i]);
            to_x[i] = lead(x[i], velocity, h, compensated ? lost_x[i] : R(0));
            to_v[i] = lead(v[i], acceleration, h, compensated ? lost_v[i] : R(0));
        }
    }
}

template <class R, bool compensated>
void stage_end(const mass_arrays<R>& start, const stage_arrays<R>& between, R sixth) {
    const R* inverse_mass = start.inverse_mass;
    for (int axis = 0; axis < 3; ++axis) {
        R *x = start.position[axis], *v = start.velocity[axis];
        R *lost_x = start.lost_position[axis], *lost_v = start.lost_velocity[axis];
        const R *force = start.force[axis], *last_v = between.velocity[axis];
        const R *slope_x = between.position_slope[axis], *slope_v = between.velocity_slope[axis];
        LIMAX_LOOP
        for (int64_t i = 0; i < start.count; ++i) {
            R carried_x = compensated ? lost_x[i] : R(0),
              carried_v = compensated ? lost_v[i] : R(0);
            const R moved = sixth * (slope_x[i] + last_v[i]);
            const R changed = sixth * fma(force[i], inverse_mass[i], slope_v[i]);
            x[i] = accumulate<compensated>(x[i], R(1), moved, carried_x);
            v[i] = accumulate<compensated>(v[i], R(1), changed, carried_v);
            if constexpr (compensated) {
                lost_x[i] = carried_x;
                lost_v[i] = carried_v;
            }
        }
    }
}
