// kernel_sets.h: which kernels serve a scene on a lattice, and how they are launched.
#pragma once

#include <memory>
#include <string>

#include "backend/backend.h"
#include "backend/cuda/driver/kernel.h"
#include "backend/cuda/kernels/records.h"
#include "backend/cuda/plan/grid_plan.h"
#include "backend/cuda/plan/tile_plan.h"

namespace limax::cuda {

// The kernels of one simulation on one GPU.
class scene_kernels {
public:
    bool shares_velocity = false;  // as in kernels/scene.h
    bool damped = false, actuated = false, has_faces = false, meets = false, has_solid = false,
         controlled = false;
    int spring_columns = 0;  // parameters of a spring
    int state_columns = 0;   // of a robot's state
    std::shared_ptr<const block_plan> plan;
    std::optional<tile_plan> tiles;  // on the tiles path

    // Arguments with everything that follows from the scene.
    template <class R>
    step_launch<R> step_arguments() const;
    template <class R>
    measure_launch<R> measure_arguments() const;

    template <class R>
    prepare_launch<R> prepare_arguments() const;
    template <class R>
    void launch_prepare(const context& gpu, const stream& stream,
                        const prepare_launch<R>& arguments, unsigned robots) const {
        launch(gpu, prepare_->function("limax_prepare"), {robots, prepare_threads}, stream, doing_,
               arguments);
    }

    void launch_summarize(const context& gpu, const stream& stream,
                          const summarize_launch& arguments) const {
        const unsigned blocks = unsigned(arguments.count - 1) / summarize_threads + 1;
        launch(gpu, summarize_->function("limax_summarize"), {blocks, summarize_threads}, stream,
               "summarizing traces", arguments);
    }

    // Elements of the other arrays of one robot, named as in step_launch and grid_launch; 0 where
    // the path or the scene does not use them.
    struct robot_memory {
        std::size_t exchange = 0, after = 0;  // on the grid path
        std::size_t sums = 0, arrived = 0;    // where several blocks share a robot
        std::size_t masses = 0, forces = 0;   // packets on the tiles path, of a robot in a launch
        std::size_t faces = 0;                // where laws act on faces
        std::size_t surface = 0, partners = 0, listed_at = 0, moved = 0;  // where masses meet
        std::size_t control = 0, genes = 0, muscles = 0;                  // of control_memory
        // of solid_columns, where there is a solid
        std::size_t solids = 0, solid_marks = 0, solid_touches = 0, solid_corners = 0,
                    solid_pairs = 0, solid_after = 0;
    };
    robot_memory memory_of_robot() const;
    // Robots that one launch of the grid path or of the tiles path steps.
    unsigned most_robots() const { return most_robots_; }

    template <class R>
    void launch_step(const context& gpu, const stream& stream, const step_launch<R>& arguments,
                     unsigned robots) const {
        launch(gpu, step_->function("limax_advance"),
               {robots, unsigned(shape_.threads), shape_.shared_bytes}, stream, doing_, arguments);
    }
    // The same on the grid path, where `robots` are at most most_robots() and arguments.arrived is
    // all 0.
    template <class R>
    void launch_grid(const context& gpu, const stream& stream, grid_launch<R> arguments,
                     unsigned robots) const {
        arguments.blocks_of_robot = blocks_of_robot(robots);
        launch_shape shape{robots * unsigned(arguments.blocks_of_robot), unsigned(grid_.threads),
                           grid_.shared_bytes};
        shape.cooperative = true;
        launch(gpu, step_->function("limax_advance"), shape, stream, doing_, arguments);
    }
    // The same on the tiles path, where all memory that tiles write but lists is 0.
    template <class R>
    void launch_tiles(const context& gpu, const stream& stream, const tile_launch<R>& arguments,
                      unsigned robots) const {
        launch_shape shape{robots * unsigned(tiles->tiles), unsigned(tiles->threads),
                           tiles->shared_bytes};
        shape.cooperative = true;
        launch(gpu, step_->function("limax_advance"), shape, stream, doing_, arguments);
    }
    bool on_grid() const { return on_grid_; }
    template <class R>
    void launch_measure(const context& gpu, const stream& stream,
                        const measure_launch<R>& arguments, unsigned robots) const {
        launch(gpu, measure_->function("limax_measure"), {robots, measure_threads}, stream, doing_,
               arguments);
    }

    // JSON object: see limax_simulation_describe().
    std::string describe() const;

private:
    friend scene_kernels load_kernels(const simulation_setup&, unsigned, kernel_form, block_plans&,
                                      gpu_place&, int);

    void choose_path(block_plans& plans, const gpu& device, int robots);
    int step_threads() const;
    std::size_t step_bytes() const;
    void define_shape(kernel_set& step) const;
    int blocks_of_robot(unsigned robots) const;
    int robots_in_cache(const gpu& device) const;

    const simulation_setup* setup_ = nullptr;
    unsigned mask_ = 0;  // effects that the kernels were made for
    bool on_grid_ = false;
    kernel_form form_ = kernel_form::many;
    int blocks_at_once_ = 0;  // where several share a robot, on the whole GPU
    unsigned most_robots_ = 0;
    std::shared_ptr<const kernel_module> step_, measure_, prepare_, summarize_;
    block_shape shape_;
    grid_shape grid_;
    std::string doing_;
};

// The kernels made for the effects of `mask`, which include the scene's, in this form. Raises
// LIMAX_NO_DEVICE, naming the first kernel that is unavailable.
scene_kernels load_kernels(const simulation_setup& setup, unsigned mask, kernel_form form,
                           block_plans& plans, gpu_place& place, int robots = 1);

// Loads, and compiles where needed, the kernels for `robots` robots of this setup. The path depends
// on lattice and precision only. Without a compiler it falls back to kernels built with limax for
// more effects, with the unused ones disabled, which give the same bits; if there are none, it
// throws LIMAX_NO_DEVICE, naming the scene and the kernel.
scene_kernels load_scene(const simulation_setup& setup, std::size_t robots, block_plans& plans,
                         gpu_place& place);

}  // namespace limax::cuda
