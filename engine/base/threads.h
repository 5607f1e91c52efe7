// threads.h: a pool of threads that works through a list, each item on one thread. Items share
// nothing, so results do not depend on which thread runs which item.
#pragma once

#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace limax {

class thread_team {
public:
    // The caller is one of the `size` threads. The others block every signal, so that Ctrl-C
    // reaches the main thread.
    explicit thread_team(int size);
    ~thread_team();
    thread_team(const thread_team&) = delete;
    thread_team& operator=(const thread_team&) = delete;

    int size() const { return static_cast<int>(threads_.size()) + 1; }

    // Runs work(0) .. work(size - 1), one call per thread, and returns when all have. The first
    // exception is thrown again here.
    void run_on_all(const std::function<void(int)>& work);
    // Runs work(i) for each item 0 .. count - 1.
    void for_each(int count, const std::function<void(int)>& work);

private:
    void serve(int index);
    void guarded(int index);
    void stop();

    std::vector<std::thread> threads_;
    std::mutex turn_;  // one round at a time
    std::mutex mutex_;
    std::condition_variable start_, finish_;
    const std::function<void(int)>* work_ = nullptr;
    std::exception_ptr failure_;
    unsigned long long round_ = 0;
    int busy_ = 0;
    bool ending_ = false;
};

}  // namespace limax
