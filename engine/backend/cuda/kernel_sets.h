// kernel_sets.h: which kernels serve a scene on a lattice, and how they are launched.
#pragma once

#include <memory>
#include <string>

#include "backend/cuda/device.h"
#include "backend/cuda/kernels/records.h"

namespace limax::cuda {

// The kernels of one simulation on one GPU.
class scene_kernels {
public:
    bool damped = false, actuated = false;
    int spring_columns = 0;  // parameters of a spring
    int state_columns = 0;   // of a robot's state
    std::shared_ptr<const block_plan> plan;

    // Arguments with everything that follows from the scene alone.
    template <class R>
    step_launch<R> step_arguments() const;
    template <class R>
    measure_launch<R> measure_arguments() const;

    template <class R>
    void launch_step(const context& gpu, const stream& stream, const step_launch<R>& arguments,
                     unsigned robots) const {
        launch(gpu, step_->function("limax_advance"),
               {robots, unsigned(shape_.threads), shape_.shared_bytes}, stream, doing_, arguments);
    }
    template <class R>
    void launch_measure(const context& gpu, const stream& stream,
                        const measure_launch<R>& arguments, unsigned robots) const {
        launch(gpu, measure_->function("limax_measure"), {robots, 256}, stream, doing_, arguments);
    }

    // JSON object: path, effects, origin, registers, spilled, shared_bytes, threads,
    // blocks_of_multiprocessor, instructions, architecture.
    std::string describe() const;

private:
    friend scene_kernels load_scene(const simulation_setup&, gpu_team&, const context&,
                                    kernel_library&);

    const simulation_setup* setup_ = nullptr;
    std::shared_ptr<const kernel_module> step_, measure_;
    block_shape shape_;
    std::string doing_;
};

// Loads, and compiles where needed, what a simulation of this setup runs on. The path follows from
// lattice and precision alone.
scene_kernels load_scene(const simulation_setup& setup, gpu_team& team, const context& gpu,
                         kernel_library& kernels);

}  // namespace limax::cuda
