// threads.cpp: a round of work starts under the mutex, every thread takes part once, and the caller
// waits for the last.
#include "base/threads.h"

#include <pthread.h>
#include <signal.h>

#include <atomic>
#include <system_error>

#include "base/error.h"

namespace limax {

thread_team::thread_team(int size) {
    sigset_t all, before;
    sigfillset(&all);
    // new threads inherit this mask
    pthread_sigmask(SIG_SETMASK, &all, &before);
    try {
        for (int index = 1; index < size; ++index)
            threads_.emplace_back([this, index] { serve(index); });
    } catch (const std::system_error& problem) {
        pthread_sigmask(SIG_SETMASK, &before, nullptr);
        const int made = this->size();
        stop();
        fail(LIMAX_NO_DEVICE, format("device 'cpu': the system gives %d of %d threads: %s", made,
                                     size, problem.what()));
    }
    pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

thread_team::~thread_team() { stop(); }

void thread_team::stop() {
    {
        std::lock_guard lock(mutex_);
        ending_ = true;
    }
    start_.notify_all();
    for (std::thread& thread : threads_) thread.join();
    threads_.clear();
}

void thread_team::guarded(int index) {
    try {
        (*work_)(index);
    } catch (...) {
        std::lock_guard lock(mutex_);
        if (!failure_) failure_ = std::current_exception();
    }
}

void thread_team::serve(int index) {
    unsigned long long seen = 0;
    std::unique_lock lock(mutex_);
    while (true) {
        start_.wait(lock, [&] { return ending_ || round_ != seen; });
        if (ending_) return;
        seen = round_;
        lock.unlock();
        guarded(index);
        lock.lock();
        if (--busy_ == 0) finish_.notify_one();
    }
}

void thread_team::run_on_all(const std::function<void(int)>& work) {
    std::lock_guard turn(turn_);
    {
        std::lock_guard lock(mutex_);
        work_ = &work;
        failure_ = nullptr;
        busy_ = static_cast<int>(threads_.size());
        ++round_;
    }
    start_.notify_all();
    guarded(0);
    std::unique_lock lock(mutex_);
    finish_.wait(lock, [&] { return busy_ == 0; });
    if (failure_) std::rethrow_exception(failure_);
}

void thread_team::for_each(int count, const std::function<void(int)>& work) {
    std::atomic<int> next{0};
    run_on_all([&](int) {
        for (int i = next++; i < count; i = next++) work(i);
    });
}

}  // namespace limax
