// solid_edges.h: contacts of the edges and faces of the rigid block, beside those of its corners
// (solid.h), in a scene with the effect `edges`. Each is a place at which the law of the fixed
// contact pushes the block, as at a corner:
//   boxes    the box's corners in the block; the middle of each edge of one that passes right
//            through the other
//   spheres  the place of the block that is nearest to the centre, unless it is a corner
//   terrain  given heights in the block; places along the block's edges, at most `spacing` apart
// Planes and the ground meet a box at its corners. In double; laws only. SI units; places from the
// robot's own origin.
#pragma once

#include "physics/solid.h"

namespace limax::solid {

// Contacts of the block with one instance, its corners included.
inline constexpr int most_touches = 128;
// A bound on how many of a box push at once: each is a corner of the two boxes' common part or
// lies between two, and this has at most 12 faces and so 20 corners.
inline constexpr double most_of_box = 20.0;

// A block of edges `size` on terrain: how many places along an edge, and all touches at most.
LIMAX_LAW double places_along(double edge, double spacing) {
    return static_cast<double>(static_cast<int64_t>(edge / spacing));
}
LIMAX_LAW double touches_of_terrain(const vector& half, double spacing) {
    const double across = places_along(2.0 * length(half), spacing) + 2.0;
    return 8.0 + across * across +
           4.0 * (places_along(2.0 * half.x, spacing) + places_along(2.0 * half.y, spacing) +
                  places_along(2.0 * half.z, spacing));
}

// A corner of a box with these half edges, by its bits, from its centre.
LIMAX_LAW vector corner_of(const vector& half, int corner) {
    return {corner & 1 ? half.x : -half.x, corner & 2 ? half.y : -half.y,
            corner & 4 ? half.z : -half.z};
}
// Calls visit(first, second) with the corners of each edge of a box.
template <class Visit>
LIMAX_LAW void each_edge(const Visit& visit) {
    for (int axis = 0; axis < 3; ++axis)
        for (int corner = 0; corner < 8; ++corner)
            if (!(corner >> axis & 1)) visit(corner, corner | 1 << axis);
}
// Where along a segment, 0 to 1, its part in a box about 0 begins and ends; it has none unless
// enter < leave.
struct crossing {
    double enter, leave;
};
LIMAX_LAW crossing crossing_of(const vector& from, const vector& to, const vector& half) {
    double enter = 0.0, leave = 1.0;
    const auto clip = [&](double a, double b, double h) {
        const double step = b - a;
        if (step == 0.0) {
            if (!(absolute(a) < h)) leave = -1.0;
            return;
        }
        const double one = (-h - a) / step, two = (h - a) / step;
        enter = larger(enter, smaller(one, two));
        leave = smaller(leave, larger(one, two));
    };
    clip(from.x, to.x, half.x);
    clip(from.y, to.y, half.y);
    clip(from.z, to.z, half.z);
    return {enter, leave};
}
// The middle of that part; below 0 unless both ends of the segment are outside.
LIMAX_LAW double middle_of_crossing(const vector& from, const vector& to, const vector& half) {
    const auto [enter, leave] = crossing_of(from, to, half);
    return enter > 0.0 && leave < 1.0 && enter < leave ? 0.5 * (enter + leave) : -1.0;
}

// Adds the pushes on edges and faces. The parameters are those of meet_contacts().
template <class EachContact, class Keep>
LIMAX_LAW void meet_edges(body& of, const EachContact& each_contact, const Keep& keep) {
    const block_params& law = of.law;
    const view block = view_of(of);
    [[maybe_unused]] int32_t moving = 0;
    each_contact([&]<class E>(E, const auto& params) {
        if constexpr (effects::moves<E>) ++moving;
        const auto push = [&](const vector& arm, double depth, const vector& normal) {
            meet_surface<E>(node_at(of, arm), of, params,
                            effects::surface_point<double, vector>{depth, normal}, arm, moving,
                            keep);
        };
        // a place of an obstacle in the block, which it pushes in through the nearest face
        const auto push_inside = [&](const vector& arm) {
            const auto point = effects::block::solid(law, to_solid(block.frame, arm));
            const vector out = to_world(block.frame, point.normal);
            push(arm, point.depth, {-out.x, -out.y, -out.z});
        };
        const auto arm_of = [&](int corner) {
            return to_world(block.frame, corner_of(law.half, corner));
        };
        if constexpr (requires { params.half; }) {
            const vector away = minus(params.center, block.place);
            const auto arm_of_box = [&](int corner) {
                return plus(away, 1.0, corner_of(params.half, corner));
            };
            for (int corner = 0; corner < 8; ++corner) push_inside(arm_of_box(corner));
            each_edge([&](int first, int second) {
                const vector from = arm_of(first), to = arm_of(second);
                const double share =
                    middle_of_crossing(minus(from, away), minus(to, away), params.half);
                if (share < 0.0) return;
                const vector arm = plus(from, share, minus(to, from));
                const auto point = E::surface(params, plus(block.place, 1.0, arm));
                push(arm, point.depth, point.normal);
            });
            each_edge([&](int first, int second) {
                const vector from = arm_of_box(first), to = arm_of_box(second);
                const double share = middle_of_crossing(to_solid(block.frame, from),
                                                        to_solid(block.frame, to), law.half);
                if (share >= 0.0) push_inside(plus(from, share, minus(to, from)));
            });
        } else if constexpr (requires { params.radius; }) {
            const vector center = to_solid(block.frame, minus(params.center, block.place));
            const auto held = [](double x, double h) { return larger(-h, smaller(h, x)); };
            const vector nearest{held(center.x, law.half.x), held(center.y, law.half.y),
                                 held(center.z, law.half.z)};
            const vector out = minus(center, nearest);
            const double distance = length(out);
            if (out.x != 0.0 && out.y != 0.0 && out.z != 0.0) return;
            if (distance > 0.0) {
                const vector normal = to_world(block.frame, out);
                push(to_world(block.frame, nearest), params.radius - distance,
                     {-normal.x / distance, -normal.y / distance, -normal.z / distance});
            } else {
                const auto point = effects::block::solid(law, center);
                const vector normal = to_world(block.frame, point.normal);
                push(to_world(block.frame, center), params.radius + point.depth,
                     {-normal.x, -normal.y, -normal.z});
            }
        } else if constexpr (effects::reads_heights<E>) {
            const double spacing = 1.0 / params.inverse_spacing;
            // the box around the block, in cells of the table
            const auto reach = [&](const vector& row) {
                return absolute(row.x) * law.half.x + absolute(row.y) * law.half.y +
                       absolute(row.z) * law.half.z;
            };
            const auto first_of = [&](double at, int32_t count) {
                const double cell =
                    smaller(larger(at * params.inverse_spacing, 0.0), double(count));
                const auto whole = static_cast<int32_t>(cell);
                return whole + (double(whole) < cell ? 1 : 0);
            };
            const double rx = reach(block.frame.x), ry = reach(block.frame.y);
            const double x = block.place.x - params.origin.x, y = block.place.y - params.origin.y;
            const int32_t nx = params.table.nx, ny = params.table.ny;
            for (int32_t i = first_of(x - rx, nx); i < first_of(x + rx, nx); ++i)
                for (int32_t j = first_of(y - ry, ny); j < first_of(y + ry, ny); ++j) {
                    const double height = double(params.table.heights[int64_t(i) * ny + j]);
                    push_inside(minus(
                        vector{params.origin.x + double(i) * spacing,
                               params.origin.y + double(j) * spacing, params.origin.z + height},
                        block.place));
                }
            each_edge([&](int first, int second) {
                const vector from = arm_of(first), to = arm_of(second);
                const int axis = (second - first) / 2;  // of the bits 1, 2, 4
                const double h = axis == 0 ? law.half.x : axis == 1 ? law.half.y : law.half.z;
                const auto places = static_cast<int>(places_along(2.0 * h, spacing));
                for (int i = 1; i <= places; ++i) {
                    const vector arm = plus(from, double(i) / double(places + 1), minus(to, from));
                    const auto point = E::surface(params, plus(block.place, 1.0, arm));
                    push(arm, point.depth, point.normal);
                }
            });
        }
    });
}

}  // namespace limax::solid
