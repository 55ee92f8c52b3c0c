// Tasks of uneven size, shared among a team of threads.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>

#include "../parallel.hpp"

namespace rangeedge {

// Calls body(i) for every i in [0, count); whichever thread is idle takes the next. Which thread takes which depends on
// chance, so results must not: no task may read what another one writes.
template <class F>
void for_tasks(int count, Team& team, F&& body) {
    std::atomic<int> next{0};
    const auto work = [&](int) {
        for (int i; (i = next.fetch_add(1, std::memory_order_relaxed)) < count;) body(i);
    };
    if (count > 1)
        team.run(work);
    else
        work(0);
}

}  // namespace rangeedge
