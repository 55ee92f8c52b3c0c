// What a team of threads and its watches promise, tried; says what does not hold.
#include <atomic>
#include <chrono>
#include <cstdio>
#include <stdexcept>
#include <thread>

#include "base/parallel.hpp"

using namespace rangeedge;
using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

namespace {

struct GivenUp {};

int failures = 0;

void expect(bool holds, const char* what) {
    if (holds) return;
    ++failures;
    std::printf("%s\n", what);
}

template <class F>
bool is_given_up(F&& call) {
    try {
        call();
    } catch (const GivenUp&) {
        return true;
    }
    return false;
}

// Passes checkpoints for a while.
void work(Clock::duration time) {
    for (const auto end = Clock::now() + time; Clock::now() < end; std::this_thread::sleep_for(1ms))
        Watch::checkpoint();
}

void a_caller_asks_while_it_waits_for_others() {
    const auto begin = Clock::now();
    Watch watch([=] {
        if (Clock::now() - begin > 100ms) throw GivenUp();
    });
    Team team(2);
    if (team.size() < 2) return;
    const bool given_up = is_given_up([&] {
        team.run([](int thread) {
            if (thread > 0) work(5s);
        });
    });
    expect(given_up && Clock::now() - begin < 2s, "a caller that is done with its share does not ask");
}

void a_watch_that_ends_leaves_the_one_around_it() {
    Watch outer([] { throw GivenUp(); });
    {
        Watch inner([] {});
        expect(!is_given_up([] { work(2 * Watch::period); }), "the outer watch is asked in place of the inner one");
    }
    expect(is_given_up([] { work(2 * Watch::period); }), "the outer watch is gone with the inner one");
}

void without_a_watch_nothing_is_given_up() {
    {
        Watch watch([] { throw GivenUp(); });
    }
    expect(!is_given_up([] { work(2 * Watch::period); }), "a watch that has ended is asked");
}

void the_first_that_throws_is_heard_when_all_are_done() {
    Team team(3);
    std::atomic<int> done{0};
    int heard = -1;
    try {
        team.run([&](int thread) {
            if (thread == 0) std::this_thread::sleep_for(20ms);
            ++done;
            throw thread;
        });
    } catch (int thread) {
        heard = thread;
    }
    expect(heard == 0, "not the first of the threads that threw is heard");
    expect(done == team.size(), "one that throws keeps the others from their work");
    team.run([&](int) { --done; });
    expect(done == 0, "a team that has thrown works no more");
}

void every_index_is_visited_once() {
    Team team(3);
    for (const int count : {0, 1, 2, 47, 48, 49, 1000}) {
        std::vector<int> visits(static_cast<std::size_t>(count), 0);
        parallel_for(count, team, [&](int begin, int end, int) {
            for (int i = begin; i < end; ++i) ++visits[static_cast<std::size_t>(i)];
        });
        parallel_each(count, team, [&](int i, int) { ++visits[static_cast<std::size_t>(i)]; });
        for (const int visited : visits) expect(visited == 2, "an index is left out, or visited twice");
    }
}

}  // namespace

int main() {
    a_caller_asks_while_it_waits_for_others();
    a_watch_that_ends_leaves_the_one_around_it();
    without_a_watch_nothing_is_given_up();
    the_first_that_throws_is_heard_when_all_are_done();
    every_index_is_visited_once();
    return failures;
}
