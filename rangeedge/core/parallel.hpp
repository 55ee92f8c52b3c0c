// Splits a loop over threads.
#pragma once

#include <algorithm>
#include <cstddef>
#include <exception>
#include <system_error>
#include <thread>
#include <vector>

namespace rangeedge {

// Runs body(begin, end, thread) on contiguous chunks that cover [0, count), at most one chunk per thread, and returns
// when all are done. `thread` counts from 0, so that each may own a buffer. Chunks depend on `threads`, results must
// not: let body(begin, end, .) do for each index what body(index, index + 1, .) would. With one thread, or one index,
// the body runs on the caller's own thread; whether the work is worth more threads is the caller's to say. Should any
// chunk throw, the rest still finish and the first chunk's exception reaches the caller.
template <class F>
void parallel_for(int count, int threads, F&& body) {
    if (count <= 0) return;
    const int chunks = std::max(1, std::min(count, threads));
    if (chunks == 1) {
        body(0, count, 0);
        return;
    }
    const auto start = [=](int chunk) { return static_cast<int>(static_cast<long long>(count) * chunk / chunks); };
    std::vector<std::exception_ptr> thrown(static_cast<std::size_t>(chunks));
    const auto run = [&](int chunk) noexcept {
        try {
            body(start(chunk), start(chunk + 1), chunk);
        } catch (...) {
            thrown[static_cast<std::size_t>(chunk)] = std::current_exception();
        }
    };
    std::vector<std::thread> workers;
    workers.reserve(static_cast<std::size_t>(chunks - 1));
    int own = 1;  // chunks this thread runs: the first, and those for which the system grants no thread
    for (int chunk = chunks - 1; chunk >= own; --chunk) {
        try {
            workers.emplace_back(run, chunk);
        } catch (const std::system_error&) {
            own = chunk + 1;
        }
    }
    for (int chunk = 0; chunk < own; ++chunk) run(chunk);
    for (std::thread& worker : workers) worker.join();
    for (const std::exception_ptr& error : thrown)
        if (error) std::rethrow_exception(error);
}

}  // namespace rangeedge
