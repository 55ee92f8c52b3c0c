// Threads that work together on one loop after the other.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "base/watch.hpp"

namespace rangeedge {

// The caller's own thread and others, which wait from one call of `run` to the next. How many threads are worth their
// work is the caller's to say; where the system grants fewer, these do all of it.
class Team {
public:
    explicit Team(int threads) {
        thrown_.resize(static_cast<std::size_t>(std::max(1, threads)));
        workers_.reserve(thrown_.size() - 1);
        try {
            for (int i = 1; i < threads; ++i)
                workers_.emplace_back([this, i, part = Watch::part()] {
                    Watch::join(part);
                    work(i);
                });
        } catch (const std::exception&) {
        }
    }
    ~Team() {
        if (workers_.empty()) return;
        start(nullptr);
        for (std::thread& worker : workers_) worker.join();
    }
    Team(const Team&) = delete;
    Team& operator=(const Team&) = delete;

    int size() const { return static_cast<int>(workers_.size()) + 1; }

    // Calls body(thread) once on every thread, counted from 0, and returns when all are done. Should any throw, the
    // rest still finish, and the exception of the thread that is counted first reaches the caller. A checkpoint on all
    // threads, and while the caller's waits for the others.
    template <class F>
    void run(F&& body) {
        if (workers_.empty()) {
            Watch::checkpoint();
            body(0);
            return;
        }
        const std::function<void(int)> job = std::ref(body);
        busy_ = static_cast<int>(workers_.size());
        start(&job);
        call(body, 0);
        while (!await([this] { return busy_ == 0; }, Watch::period)) call([](int) {}, 0);
        std::exception_ptr first;
        for (std::exception_ptr& thrown : thrown_) {
            if (!first) first = thrown;
            thrown = nullptr;
        }
        if (first) std::rethrow_exception(first);
    }

private:
    void start(const std::function<void(int)>* job) {
        {
            const std::lock_guard<std::mutex> lock(mutex_);
            job_ = job;
            ++round_;
        }
        changed_.notify_all();
    }
    void work(int thread) {
        for (int round = 0;;) {
            while (!await([this, round] { return round_ != round; }, std::chrono::hours(1))) {
            }
            ++round;
            if (!job_) return;
            call(*job_, thread);
            {
                const std::lock_guard<std::mutex> lock(mutex_);
                --busy_;
            }
            changed_.notify_all();
        }
    }
    // A checkpoint, and then the job. Of what is thrown, the first is kept.
    template <class F>
    void call(F&& job, int thread) noexcept {
        std::exception_ptr& thrown = thrown_[static_cast<std::size_t>(thread)];
        try {
            Watch::checkpoint();
            job(thread);
        } catch (...) {
            if (!thrown) thrown = std::current_exception();
        }
    }
    // Whether it is ready at last, `most` from now. Loops follow each other closely: asking again and again for a while
    // is quicker than being woken.
    template <class F>
    bool await(F&& ready, std::chrono::milliseconds most) {
        const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(1);
        do {
            for (int i = 0; i < 32; ++i)
                if (ready()) return true;
            std::this_thread::yield();
        } while (std::chrono::steady_clock::now() < end);
        std::unique_lock<std::mutex> lock(mutex_);
        return changed_.wait_for(lock, most, ready);
    }

    std::vector<std::thread> workers_;
    std::vector<std::exception_ptr> thrown_;
    std::mutex mutex_;
    std::condition_variable changed_;
    const std::function<void(int)>* job_ = nullptr;
    std::atomic<int> round_{0}, busy_{0};
};

// Runs body(begin, end, thread) on contiguous chunks that cover [0, count), and returns when all are done. Those of one
// thread follow each other, with a checkpoint before each. `thread` counts from 0, so that each may own a buffer.
// Chunks depend on the team, results must not: let body(begin, end, .) do for each index what body(index, index + 1, .)
// would.
template <class F>
void parallel_for(int count, Team& team, F&& body) {
    constexpr int chunks = 16;  // of a thread
    team.run([&](int thread) {
        const auto start = [&](int chunk) {
            return static_cast<int>(static_cast<long long>(count) * chunk / (chunks * team.size()));
        };
        for (int chunk = chunks * thread; chunk < chunks * (thread + 1); ++chunk) {
            if (start(chunk) == start(chunk + 1)) continue;
            Watch::checkpoint();
            body(start(chunk), start(chunk + 1), thread);
        }
    });
}

// Calls body(i, thread) for every i in [0, count); a thread that is done with one takes the next. For loops whose steps
// differ in cost.
template <class F>
void parallel_each(int count, Team& team, F&& body) {
    std::atomic<int> next{0};
    const auto work = [&](int thread) {
        for (int i = next++; i < count; i = next++) {
            Watch::checkpoint();
            body(i, thread);
        }
    };
    if (count > 1)
        team.run(work);
    else
        work(0);
}

template <class F>
void parallel_for(int count, int threads, F&& body) {
    Team team(std::min(count, threads));
    parallel_for(count, team, body);
}

}  // namespace rangeedge
