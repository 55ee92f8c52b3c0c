// How a kernel is given up while it works. Whoever calls a kernel may put it under a watch, which is asked now and then
// on the caller's own thread, and throws where the result is no longer wanted: an exception that unwinds the kernel on
// all its threads and reaches the caller. Kernels do no more than pass checkpoints, some every few milliseconds.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <exception>
#include <functional>
#include <utility>

namespace rangeedge {

// Thrown on other threads of a team once the watch has thrown on the caller's.
struct Stopped : std::exception {
    const char* what() const noexcept override { return "stopped"; }
};

class Watch {
public:
    static constexpr std::chrono::milliseconds period{50};

    // `ask` is called once a period, on this thread, while the watch lasts.
    explicit Watch(std::function<void()> ask)
        : ask_(std::move(ask)), next_(Clock::now() + period), outer_(std::exchange(own(), {this, true})) {}
    ~Watch() { own() = outer_; }
    Watch(const Watch&) = delete;
    Watch& operator=(const Watch&) = delete;

    // The part of a thread: whether it has a watch, and made it.
    struct Part {
        Watch* watch = nullptr;
        bool asks = false;
    };
    static Part part() { return own(); }
    // A thread that works for the one whose part this was.
    static void join(const Part& part) { own() = {part.watch, false}; }

    // Throws where the work of this thread is no longer wanted.
    static void checkpoint() {
        const Part& part = own();
        if (part.watch) part.watch->check(part.asks);
    }

private:
    using Clock = std::chrono::steady_clock;

    static Part& own() {
        thread_local Part part;
        return part;
    }
    void check(bool asks) {
        if (stopped_.load(std::memory_order_relaxed)) throw Stopped();
        if (!asks || Clock::now() < next_) return;
        try {
            ask_();
        } catch (...) {
            stopped_.store(true, std::memory_order_relaxed);
            throw;
        }
        next_ = Clock::now() + period;
    }

    std::function<void()> ask_;
    Clock::time_point next_;
    Part outer_;
    std::atomic<bool> stopped_{false};
};

// For loops of many short steps: a checkpoint every so many of them.
class Checkpoints {
public:
    explicit Checkpoints(int steps = 4096) : steps_(steps), left_(steps) {}
    void pass() {
        if (--left_ > 0) return;
        left_ = steps_;
        Watch::checkpoint();
    }

private:
    int steps_, left_;
};

}  // namespace rangeedge
