// environment.h: an environment variable that a test may set; restored at the end of the test.
#pragma once

#include <cstdlib>
#include <string>

namespace limax::test {

// No other thread runs while a test sets a variable.
// NOLINTBEGIN(concurrency-mt-unsafe)
class environment_variable {
public:
    explicit environment_variable(const char* name) : name_(name) {
        const char* value = std::getenv(name);
        was_set_ = value != nullptr;
        if (was_set_) before_ = value;
    }
    environment_variable(const environment_variable&) = delete;
    ~environment_variable() {
        if (was_set_)
            set(before_.c_str());
        else
            unset();
    }

    void set(const char* value) const { setenv(name_, value, 1); }
    void unset() const { unsetenv(name_); }

private:
    const char* name_;
    bool was_set_;
    std::string before_;
};
// NOLINTEND(concurrency-mt-unsafe)

}  // namespace limax::test
