// ranks.cpp: what a run on several ranks needs of MPI: a gather, sums, genomes to the ranks that
// need them, and a thread that notices when another rank is lost. A library of its own, which only
// a process loads that mpirun or srun started; scripts/lib/base/ranks.lua declares and calls it.
// One thread calls its functions.
#include <mpi.h>
#include <pthread.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <numeric>
#include <string>
#include <thread>
#include <vector>

#define LIMAX_PUBLIC __attribute__((visibility("default")))

namespace {

using clock_type = std::chrono::steady_clock;
using namespace std::chrono_literals;

// How often a rank shows that it is alive, and after how long without a sign it is lost.
constexpr std::chrono::milliseconds sign_interval = 500ms, longest_silence = 7s,
                                    watch_interval = 50ms;
constexpr int tag_alive = 1, tag_finished = 2;

int rank = 0, ranks = 1;
MPI_Comm signs = MPI_COMM_NULL;
MPI_Request pending = MPI_REQUEST_NULL;
MPI_Datatype item = MPI_DATATYPE_NULL;  // of what is pending
std::vector<int> counts, places, counts_in, places_in;
std::thread watcher;
std::atomic<bool> stop_watching{false}, rank_0_reports{false};

struct peer {
    int rank;
    clock_type::time_point seen = clock_type::now();
    MPI_Request sign = MPI_REQUEST_NULL;
};

// Rank 0 and every other rank send each other signs. One that is lost ends this process as SIGTERM
// does: the run keeps its last whole generation.
void watch() {
    std::vector<peer> peers;
    for (int other = rank == 0 ? 1 : 0; other < (rank == 0 ? ranks : 1); ++other)
        peers.push_back({other});
    auto last_sign = clock_type::time_point{}, last_look = clock_type::now();
    while (!stop_watching) {
        const auto now = clock_type::now();
        // this process was stopped itself
        if (now - last_look > longest_silence / 2)
            for (peer& each : peers) each.seen = now;
        last_look = now;
        if (now - last_sign > sign_interval) {
            for (peer& each : peers) {
                int sent = 1;
                MPI_Test(&each.sign, &sent, MPI_STATUS_IGNORE);
                if (sent != 0)
                    MPI_Isend(nullptr, 0, MPI_BYTE, each.rank, tag_alive, signs, &each.sign);
            }
            last_sign = now;
        }
        for (int arrived = 1; arrived != 0;) {
            MPI_Status from{};
            MPI_Iprobe(MPI_ANY_SOURCE, MPI_ANY_TAG, signs, &arrived, &from);
            if (arrived == 0) break;
            MPI_Recv(nullptr, 0, MPI_BYTE, from.MPI_SOURCE, from.MPI_TAG, signs, &from);
            if (from.MPI_TAG == tag_finished) rank_0_reports = true;
            for (peer& each : peers)
                if (each.rank == from.MPI_SOURCE) each.seen = now;
        }
        for (const peer& each : peers)
            if (now - each.seen > longest_silence) {
                if (rank == 0 || rank == 1)
                    std::fprintf(stderr, "limax: rank %d has not answered for %d s\n", each.rank,
                                 int(longest_silence / 1s));
                kill(getpid(), SIGTERM);
                return;
            }
        std::this_thread::sleep_for(watch_interval);
    }
}

// Counts of MPI are int: of items, of which there may be more than 2 GB.
void begin_items(int bytes) {
    MPI_Type_contiguous(bytes, MPI_BYTE, &item);
    MPI_Type_commit(&item);
}

void count_items(const int* numbers, std::vector<int>& own, std::vector<int>& first) {
    own.assign(numbers, numbers + ranks);
    first.assign(ranks, 0);
    std::partial_sum(own.begin(), own.end() - 1, first.begin() + 1);
}

// A child process is not a rank.
void forget_launcher() {
    std::vector<std::string> names;
    for (char** entry = environ; *entry != nullptr; ++entry)
        for (const char* prefix : {"OMPI_", "PMIX_", "PMI_"})
            if (std::strncmp(*entry, prefix, std::strlen(prefix)) == 0)
                names.emplace_back(*entry, std::strcspn(*entry, "="));
    // NOLINTNEXTLINE(concurrency-mt-unsafe): MPI has read them
    for (const std::string& name : names) unsetenv(name.c_str());
}

}  // namespace

extern "C" {

// Joins the other ranks. Returns 0, or 1 where MPI does not serve several threads.
LIMAX_PUBLIC int limax_ranks_start(int* own, int* count) {
    int served = 0;
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_MULTIPLE, &served);
    if (served < MPI_THREAD_MULTIPLE) return 1;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    MPI_Comm_dup(MPI_COMM_WORLD, &signs);
    forget_launcher();
    *own = rank;
    *count = ranks;
    if (ranks > 1) {
        // its thread takes no signals
        sigset_t all, before;
        sigfillset(&all);
        pthread_sigmask(SIG_SETMASK, &all, &before);
        watcher = std::thread(watch);
        pthread_sigmask(SIG_SETMASK, &before, nullptr);
    }
    return 0;
}

// Begins to gather each rank's number of bytes. The result is complete when limax_ranks_done.
LIMAX_PUBLIC void limax_ranks_gather_sizes(const int64_t* own, int64_t* sizes) {
    MPI_Iallgather(own, 1, MPI_INT64_T, sizes, 1, MPI_INT64_T, MPI_COMM_WORLD, &pending);
}

// Begins to gather the texts of all ranks, one after the other, in `all`: less than 2 GB, as MPI
// counts with int. `sizes` are those of limax_ranks_gather_sizes.
LIMAX_PUBLIC void limax_ranks_gather(const char* text, const int64_t* sizes, char* all) {
    counts.assign(sizes, sizes + ranks);
    places.assign(ranks, 0);
    std::partial_sum(counts.begin(), counts.end() - 1, places.begin() + 1);
    MPI_Iallgatherv(text, counts[rank], MPI_BYTE, all, counts.data(), places.data(), MPI_BYTE,
                    MPI_COMM_WORLD, &pending);
}

// Begins to add up values of all ranks, in place.
LIMAX_PUBLIC void limax_ranks_sum(int64_t* values, int count) {
    MPI_Iallreduce(MPI_IN_PLACE, values, count, MPI_INT64_T, MPI_SUM, MPI_COMM_WORLD, &pending);
}

// Begins to complete items of `bytes` in place: each rank has a part of them, in the order of the
// ranks, which `numbers` [rank] counts.
LIMAX_PUBLIC void limax_ranks_share(void* items, const int* numbers, int bytes) {
    count_items(numbers, counts, places);
    begin_items(bytes);
    MPI_Iallgatherv(MPI_IN_PLACE, 0, MPI_DATATYPE_NULL, items, counts.data(), places.data(), item,
                    MPI_COMM_WORLD, &pending);
}

// Begins to send items of `bytes` to each rank, and to receive some from each. `out` and `in` hold
// them by rank, `sent` and `received` [rank] count them.
LIMAX_PUBLIC void limax_ranks_trade(const void* out, const int* sent, void* in, const int* received,
                                    int bytes) {
    count_items(sent, counts, places);
    count_items(received, counts_in, places_in);
    begin_items(bytes);
    MPI_Ialltoallv(out, counts.data(), places.data(), item, in, counts_in.data(), places_in.data(),
                   item, MPI_COMM_WORLD, &pending);
}

// Whether what was begun last is complete. Polls for so many seconds, since each poll moves only a
// few fragments of a message.
LIMAX_PUBLIC int limax_ranks_done(double seconds) {
    const auto until = clock_type::now() + std::chrono::duration<double>(seconds);
    int done = 0;
    for (;;) {
        MPI_Test(&pending, &done, MPI_STATUS_IGNORE);
        if (done != 0 || clock_type::now() >= until) break;
        std::this_thread::yield();
    }
    if (done != 0 && item != MPI_DATATYPE_NULL) MPI_Type_free(&item);
    return done;
}

// Whether this rank reports that a run ended early: rank 0, or rank 1 if rank 0 is lost.
LIMAX_PUBLIC int limax_ranks_reports(void) {
    if (rank == 0) {
        static MPI_Request request;
        if (ranks > 1) MPI_Isend(nullptr, 0, MPI_BYTE, 1, tag_finished, signs, &request);
        return 1;
    }
    // mpirun kills within a second of asking to end, and at once where another rank has ended
    const auto until = clock_type::now() + (rank == 1 ? 200ms : 400ms);
    while (!rank_0_reports && clock_type::now() < until) std::this_thread::sleep_for(10ms);
    return rank == 1 && !rank_0_reports ? 1 : 0;
}

// Ends the thread that watches, and so all transfers.
LIMAX_PUBLIC void limax_ranks_stop(void) {
    stop_watching = true;
    if (watcher.joinable()) watcher.join();
}

// Leaves the other ranks. All ranks must call it, one after a gather at the end of its work.
LIMAX_PUBLIC void limax_ranks_finish(void) {
    limax_ranks_stop();
    MPI_Finalize();
}
}
