/* SPDX-License-Identifier: BSD-3-Clause */
/* Threads that share small pieces of work with the caller: each takes the next free piece. They wait actively for a
 * while, then asleep; the caller never waits for a thread that has not begun. */
#pragma once

#include <stdbool.h>

typedef struct kmp_team kmp_team;
typedef void kmp_team_work(void *self, int piece);

enum { KMP_TEAM_MOST = 64 }; /* threads */

/** A pool of `threads` threads, the caller included; fewer where the system gives no more. NULL: no memory. */
kmp_team *kmp_team_new(int threads);
void kmp_team_free(kmp_team *team);

/** Processors that this process may use. */
int kmp_processors(void);

/** The number of threads requested. */
int kmp_team_threads(const kmp_team *team);

/** In a piece of work: which thread of the team does it, 0 .. threads - 1; 0 is the caller. */
int kmp_team_thread(const kmp_team *team);

/** Does pieces 0 .. count - 1 (count < 65536), in any order, and returns when all are done. One call at a time. */
void kmp_team_run(kmp_team *team, int count, kmp_team_work *work, void *self);

/** Brings one more piece, which the next shared call does in addition to its own ones; kmp_team_settle does it if no
 * call has. It must not depend on that call, nor the call on it. */
void kmp_team_bring(kmp_team *team, kmp_team_work *work, void *self);
void kmp_team_settle(kmp_team *team);

/** Seconds of processor time of all threads but the caller's, waiting included; 0 without a pool, or where the system
 * does not report it. */
double kmp_team_cpu(const kmp_team *team);

/** True if the next call is not shared, because a processor was taken away in the middle of a piece. */
bool kmp_team_rests(const kmp_team *team);
