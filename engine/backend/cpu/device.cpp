// device.cpp: the CPU as a device: its threads, its passes and its description.
#include "backend/cpu/device.h"

#include <sched.h>

#include <fstream>
#include <nlohmann/json.hpp>

namespace limax::cpu {

namespace {

int usable_cores() {
    cpu_set_t set;
    if (sched_getaffinity(0, sizeof set, &set) == 0) return CPU_COUNT(&set);
    return 1;
}

std::string processor_name() {
    std::ifstream file("/proc/cpuinfo");
    for (std::string line; std::getline(file, line);)
        if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
    return "unknown";
}

class cpu_device final : public device {
public:
    cpu_device(int threads, const char* isa, const std::string& why_not_cuda)
        : passes_(choose_passes(isa)),
          team_(std::make_shared<thread_team>(threads > 0 ? threads : usable_cores())),
          each_([team = team_](int count, const std::function<void(int)>& work) {
              team->for_each(count, work);
          }) {
        nlohmann::ordered_json text;
        text["kind"] = "cpu";
        text["threads"] = team_->size();
        text["isa"] = passes_.isa;
        text["isa_available"] = available_isas();
        text["cpu"] = processor_name();
        text["cores"] = usable_cores();
        text["compiler"] = LIMAX_COMPILER;
        text["build"] = LIMAX_BUILD_TYPE;
        text["cuda"] = why_not_cuda;
        description_ = text.dump();
    }
    const char* describe() const override { return description_.c_str(); }
    const parallel_for& each() const override { return each_; }
    express_pass express() const override { return passes_.express; }
    std::unique_ptr<simulation> simulate(simulation_setup setup) override {
        return make_simulation(std::move(setup), passes_, team_);
    }

private:
    const pass_table& passes_;
    std::shared_ptr<thread_team> team_;
    parallel_for each_;
    std::string description_;
};

}  // namespace

std::unique_ptr<device> make_cpu_device(int threads, const char* isa,
                                        const std::string& why_not_cuda) {
    return std::make_unique<cpu_device>(threads, isa, why_not_cuda);
}

}  // namespace limax::cpu
