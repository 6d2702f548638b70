/* SPDX-License-Identifier: BSD-3-Clause */
/* One atomic number holds the work's identity, its number of pieces and the next piece: a thread that changes it takes
 * that piece. No thread is obliged to answer a call: where the processors are busy elsewhere, the caller does all. */
#include "base/thread_pool.h"
#include "base/memory.h"
#include "platform/platform.h"
#include <pthread.h>
#include <stdatomic.h>
#include <stdint.h>

/* Calls that run only on the caller after a late piece: FIRST_REST at first, twice as many each time; fewer again
 * after punctual calls. */
enum { FIRST_REST = 16, LONGEST_REST = 4096 };
static const double LATE = 50e-6;      /* s */
enum { AWAKE = 4000, PATIENT = 2000 }; /* looks, some 50 ns each: before sleeping; before giving the processor away */
enum { LONG_WAIT = 100000, NAP = 50000 }; /* looks until the caller naps; ns of a nap */

typedef struct helper {
    kmp_team *team;
    int index;
} helper;

/* The team that this thread helps, NULL: none. */
static _Thread_local helper own = {0};

struct kmp_team {
    char before[64];         /* pads each to a cache line */
    _Atomic uint64_t ticket; /* work << 32 | pieces << 16 | the next one */
    char between[64];
    atomic_int done;
    char after[64];
    atomic_int sleepers;
    atomic_bool ends;
    atomic_bool stolen;            /* a processor was taken from a thread other than the caller's during this call */
    kmp_team_work *work, *brought; /* of this call; of a piece that the next call does first, NULL: none */
    void *self, *of_brought;
    bool takes;           /* piece 0 of this call is the one brought */
    int rest, longest;    /* calls that are not shared for now; of the last such rest */
    int threads, started; /* requested threads; threads that run in addition to the caller's */
    pthread_t thread[KMP_TEAM_MOST];
    helper helper[KMP_TEAM_MOST];
    pthread_mutex_t lock;
    pthread_cond_t called;
};

static void pause_a_moment(void)
{
#if defined(__x86_64__) || defined(__i386__)
    __builtin_ia32_pause();
#endif
}

static bool has_more(uint64_t ticket)
{
    return (ticket & 0xffff) < (ticket >> 16 & 0xffff);
}

static void do_piece(const kmp_team *team, int piece)
{
    if (team->takes && piece == 0)
        team->brought(team->of_brought, 0);
    else
        team->work(team->self, piece - team->takes);
}

/* A piece by a thread other than the caller's. Wall-clock time minus processor time is time without a processor: an
 * unequal piece takes long by both clocks. */
static void help_with(kmp_team *team, int piece)
{
    double wall = kmp_wall_now(), cpu = kmp_cpu_now();
    do_piece(team, piece);
    cpu = kmp_cpu_now() - cpu;
    if (kmp_wall_now() - wall - cpu > LATE)
        atomic_store_explicit(&team->stolen, true, memory_order_relaxed);
}

/* false: there was none. */
static bool do_one(kmp_team *team, bool helps)
{
    uint64_t ticket = atomic_load_explicit(&team->ticket, memory_order_acquire);
    while (has_more(ticket))
        if (atomic_compare_exchange_weak_explicit(&team->ticket, &ticket, ticket + 1, memory_order_acq_rel,
                                                  memory_order_acquire)) {
            if (helps)
                help_with(team, (int)(ticket & 0xffff));
            else
                do_piece(team, (int)(ticket & 0xffff));
            atomic_fetch_add_explicit(&team->done, 1, memory_order_release);
            return true;
        }
    return false;
}

static void sleep_until_called(kmp_team *team)
{
    (void)pthread_mutex_lock(&team->lock);
    atomic_fetch_add(&team->sleepers, 1);
    while (!has_more(atomic_load(&team->ticket)) && !atomic_load(&team->ends))
        (void)pthread_cond_wait(&team->called, &team->lock);
    atomic_fetch_sub(&team->sleepers, 1);
    (void)pthread_mutex_unlock(&team->lock);
}

static void *help(void *self)
{
    own = *(const helper *)self;
    kmp_team *team = own.team;
    for (int looks = 0; !atomic_load_explicit(&team->ends, memory_order_relaxed); looks++) {
        if (do_one(team, true))
            looks = 0;
        else if (looks < AWAKE)
            pause_a_moment();
        else {
            sleep_until_called(team);
            looks = 0;
        }
    }
    return NULL;
}

kmp_team *kmp_team_new(int threads)
{
    kmp_team *team = KMP_NEW(kmp_team, 1);
    if (!team)
        return NULL;
    team->threads = threads < 1 ? 1 : threads > KMP_TEAM_MOST ? KMP_TEAM_MOST : threads;
    team->lock = (pthread_mutex_t)PTHREAD_MUTEX_INITIALIZER;
    team->called = (pthread_cond_t)PTHREAD_COND_INITIALIZER;
    for (int k = 0; k < team->threads; k++)
        team->helper[k] = (helper){team, k + 1};
    while (team->started < team->threads - 1 &&
           kmp_thread_start(&team->thread[team->started], help, &team->helper[team->started]))
        team->started++;
    return team;
}

static void wake(kmp_team *team)
{
    (void)pthread_mutex_lock(&team->lock);
    (void)pthread_cond_broadcast(&team->called);
    (void)pthread_mutex_unlock(&team->lock);
}

void kmp_team_free(kmp_team *team)
{
    if (!team)
        return;
    atomic_store(&team->ends, true);
    wake(team);
    for (int k = 0; k < team->started; k++)
        (void)pthread_join(team->thread[k], NULL);
    (void)pthread_cond_destroy(&team->called);
    (void)pthread_mutex_destroy(&team->lock);
    kmp_free(team);
}

/* A sleeper reads the ticket after it has counted itself; the caller reads the count after it has set the ticket. So
 * one of them sees the other. */
void kmp_team_run(kmp_team *team, int count, kmp_team_work *work, void *self)
{
    uint64_t last = atomic_load_explicit(&team->ticket, memory_order_relaxed);
    if (team->started == 0 || team->rest > 0) {
        team->rest -= team->rest > 0;
        for (int k = 0; k < count; k++)
            work(self, k);
        return;
    }
    team->work = work;
    team->self = self;
    team->takes = team->brought;
    count += team->takes;
    atomic_store_explicit(&team->done, 0, memory_order_relaxed);
    atomic_store_explicit(&team->stolen, false, memory_order_relaxed);
    atomic_store(&team->ticket, ((last >> 32) + 1) << 32 | (uint64_t)count << 16);
    if (atomic_load(&team->sleepers) > 0)
        wake(team);
    while (do_one(team, false))
        ;
    double from = kmp_wall_now();
    for (int looks = 0; atomic_load_explicit(&team->done, memory_order_acquire) < count; looks++)
        if (looks % PATIENT < PATIENT - 1)
            pause_a_moment();
        else if (looks < LONG_WAIT)
            kmp_thread_yield();
        else
            kmp_thread_rest(NAP);
    if (team->takes)
        team->brought = NULL;
    /* A processor that was taken away in the middle of a piece keeps the caller waiting for milliseconds. If other
     * processes need the processors, this recurs: then only the caller is quicker. */
    double waited = kmp_wall_now() - from;
    if (waited > LATE && atomic_load_explicit(&team->stolen, memory_order_relaxed)) {
        int rest = 2 * team->longest > FIRST_REST ? 2 * team->longest : FIRST_REST;
        team->rest = team->longest = rest < LONGEST_REST ? rest : LONGEST_REST;
    } else {
        team->longest -= (team->longest + 15) / 16;
    }
}

void kmp_team_bring(kmp_team *team, kmp_team_work *work, void *self)
{
    team->brought = work;
    team->of_brought = self;
}

void kmp_team_settle(kmp_team *team)
{
    if (team->brought)
        team->brought(team->of_brought, 0);
    team->brought = NULL;
}

double kmp_team_cpu(const kmp_team *team)
{
    double sum = 0;
    for (int k = 0; team && k < team->started; k++)
        sum += kmp_thread_cpu(team->thread[k]);
    return sum;
}

bool kmp_team_rests(const kmp_team *team)
{
    return team->rest > 0;
}

int kmp_processors(void)
{
    const int count = kmp_system_processors();
    return count > KMP_TEAM_MOST ? KMP_TEAM_MOST : count;
}

int kmp_team_thread(const kmp_team *team)
{
    return own.team == team ? own.index : 0;
}

int kmp_team_threads(const kmp_team *team)
{
    return team->threads;
}
