/* SPDX-License-Identifier: BSD-3-Clause */
#include "backend/lazy_jit.h"
#include "backend/prepared.h"
#include "base/memory.h"

/* Machine code takes 125 ns an operation to write, the tape 35 ns; a run of it takes 0.5 ns an operation less
 * (limousine63 in docs/decisions/native.md). Code of fewer operations than LEAST is written in half a millisecond. */
enum { RUNS = 200, LEAST = 4000 };
/* The same for code that later processes take from the cache. */
enum { RUNS_KEPT = 20 };

typedef struct waiting {
    const kmp_program *program;
    const kmp_backend *now; /* tape, then native */
    void *code, *taped;     /* of `now`; the tape's, whose outputs callers may still hold */
    int64_t left;           /* operations to run on the tape; 0: no change will follow */
} waiting;

static void release(void *self)
{
    waiting *w = self;
    if (w->code)
        w->now->release(w->code);
    if (w->taped)
        kmp_backend_tape.release(w->taped);
    kmp_free(w);
}

static int runs_of(const kmp_program *p)
{
    kmp_cache_key key;
    return kmp_program_folder(p, KMP_X86_ONE, &key) ? RUNS_KEPT : RUNS;
}

static void *prepare(const kmp_program *p)
{
    waiting *w = KMP_NEW(waiting, 1);
    int total = p->code[p->stages];
    bool at_once = total < LEAST || !kmp_x86_runs(KMP_X86_ONE) || kmp_prepared_known(p, KMP_X86_ONE, 0);
    if (!w)
        return NULL;
    *w = (waiting){.program = p,
                   .now = at_once ? &kmp_backend_native : &kmp_backend_tape,
                   .left = at_once ? 0 : (int64_t)runs_of(p) * total};
    w->code = w->now->prepare(p);
    if (w->code)
        return w;
    kmp_free(w);
    return NULL;
}

/* Goes over to machine code, with the inputs and the values of all earlier stages. Without memory the tape stays. */
static void change(waiting *w, int stage)
{
    void *code = kmp_backend_native.prepare(w->program);
    w->left = 0;
    if (!code)
        return;
    const kmp_frame *from = w->code, *to = code; /* a frame is the first member of either */
    for (int k = 0; k < from->feed_start[KMP_IN_COUNT]; k++)
        to->v[to->feeds[k].slot] = from->v[from->feeds[k].slot];
    for (int s = 0; s < stage; s++)
        kmp_backend_native.run(code, s);
    w->taped = w->code;
    w->code = code;
    w->now = &kmp_backend_native;
}

static void set(void *self, kmp_input_kind kind, const double *values)
{
    const waiting *w = self;
    w->now->set(w->code, kind, values);
}

static void run(void *self, int stage)
{
    waiting *w = self;
    if (w->left > 0) {
        w->left -= w->program->code[stage + 1] - w->program->code[stage];
        if (w->left <= 0)
            change(w, stage);
    }
    w->now->run(w->code, stage);
}

static const double *outputs(const void *self, int stage)
{
    const waiting *w = self;
    return w->now->outputs(w->code, stage);
}

static void count(const void *self, kmp_block_counts *counts)
{
    const waiting *w = self;
    w->now->count(w->code, counts);
    if (w->taped)
        kmp_backend_tape.count(w->taped, counts);
}

const kmp_backend *kmp_backend_waiting(const kmp_backend *backend)
{
    static const kmp_backend either = {"native", prepare, release, set, run, outputs, count, NULL, NULL, NULL};
    return backend == &kmp_backend_native ? &either : backend;
}
