/* SPDX-License-Identifier: BSD-3-Clause */
/* Machine code for the arithmetic between functions, in the program's order: the operations and the roundings of the
 * tape, so that the bits are its bits. If the machine has no such code, or the system does not let it run, the tape
 * runs. */
#include "backend/native.h"
#include "backend/prepared.h"
#include "base/memory.h"
#include "platform/platform.h"
#include <math.h>
#include <stdatomic.h>

typedef struct native {
    kmp_frame frame;             /* first, as in the tape */
    kmp_routine *const *segment; /* of the prepared code */
} native;

/* -- construction ------------------------------------------------------------------------------------ */

static void release(void *code)
{
    native *n = code;
    if (n && n->frame.taped) {
        kmp_backend_tape.release(code);
    } else if (n) {
        kmp_frame_free(&n->frame);
        kmp_free(n);
    }
}

/* From the code that all machines of the program share, in parts for a thread pool. false: no memory. Without segments
 * there is no code. */
static bool take_prepared(native *n, const kmp_program *p, kmp_team *team)
{
    const kmp_prepared *prepared = kmp_prepared_of(p, KMP_CODE_ONE, team ? kmp_team_threads(team) : 0);
    if (!prepared || !prepared->code.pages)
        return prepared;
    n->segment = prepared->code.segment;
    return kmp_prepared_frame(prepared, &n->frame, team) && kmp_prepared_values(prepared, &n->frame);
}

static void *share(const kmp_program *p, kmp_team *team)
{
    native *n = KMP_NEW(native, 1);
    bool ok = n && (!kmp_code_runs(KMP_CODE_ONE) || take_prepared(n, p, team));
    if (ok && n->segment)
        return n;
    release(n);
    return ok ? kmp_backend_tape.prepare(p) : NULL;
}

static void *prepare(const kmp_program *p)
{
    return share(p, NULL);
}

/* -- run --------------------------------------------------------------------------------------------- */

static void run_segments(native *n, uint32_t begin, uint32_t end)
{
    for (uint32_t g = begin; g < end; g++) {
        if (n->segment[g])
            n->segment[g](n->frame.v);
        kmp_frame_functions(&n->frame, g);
    }
}

typedef struct piece {
    native *n;
    const uint32_t *first; /* segments of the parts */
    uint32_t stage;        /* the stage's first segment */
} piece;

static void run_part(void *self, int part)
{
    const piece *p = self;
    run_segments(p->n, p->stage + p->first[part], p->stage + p->first[part + 1]);
}

static void run(void *code, int stage)
{
    native *n = code;
    kmp_frame *f = &n->frame;
    if (f->taped) {
        kmp_backend_tape.run(code, stage);
        return;
    }
    const int parts = kmp_frame_parts(f, stage);
    if (parts > 0) {
        /* The segments before the parts; the parts, shared with the thread pool; the segments after them. */
        piece p = {n, f->part_first + f->part_start[stage] + 1, f->stage[stage]};
        run_part(&p, -1);
        kmp_team_run(f->team, parts, run_part, &p);
        run_part(&p, parts);
    } else {
        run_segments(n, f->stage[stage], f->stage[stage + 1]);
    }
    kmp_frame_copies(f, stage);
}

const kmp_backend kmp_backend_native = {"native",          prepare,         release, kmp_frame_set, run,
                                        kmp_frame_outputs, kmp_frame_count, share,   true,          NULL};

bool kmp_native_runs(void)
{
    static atomic_int known; /* 1: it runs, -1: it does not */
    int runs = atomic_load(&known);
    if (runs == 0) {
        const double code = 0; /* only its pages count, it does not run */
        void *pages = kmp_code_runs(KMP_CODE_ONE) ? kmp_pages_new(&code, sizeof code) : NULL;
        runs = pages ? 1 : -1;
        kmp_pages_free(pages, sizeof code);
        atomic_store(&known, runs);
    }
    return runs > 0;
}

/* -- tape first, then machine code ----------------------------------------------------------------------- */

/* Machine code takes 125 ns an operation to write, the tape 35 ns; a run of it takes 0.5 ns an operation less
 * (limousine63 in docs/decisions/native.md). Code of fewer operations than LEAST is written in half a millisecond. */
enum { RUNS = 200, LEAST_LATER = 4000 };
/* The same for code that later processes take from the cache. */
enum { RUNS_KEPT = 20 };

typedef struct waiting {
    const kmp_program *program;
    const kmp_backend *now; /* tape, then native */
    void *code, *taped;     /* of `now`; the tape's, whose outputs callers may still hold */
    int64_t left;           /* operations to run on the tape; 0: no change will follow */
} waiting;

static void release_either(void *self)
{
    waiting *w = self;
    if (w->code)
        w->now->release(w->code);
    if (w->taped)
        kmp_backend_tape.release(w->taped);
    kmp_free(w);
}

static void *prepare_either(const kmp_program *p)
{
    waiting *w = KMP_NEW(waiting, 1);
    int total = p->code[p->stages];
    bool at_once = total < LEAST_LATER || !kmp_code_runs(KMP_CODE_ONE) || kmp_prepared_known(p, KMP_CODE_ONE, 0);
    if (!w)
        return NULL;
    kmp_cache_key key;
    *w = (waiting){.program = p,
                   .now = at_once ? &kmp_backend_native : &kmp_backend_tape,
                   .left =
                       at_once ? 0 : (int64_t)(kmp_program_folder(p, KMP_CODE_ONE, &key) ? RUNS_KEPT : RUNS) * total};
    w->code = w->now->prepare(p);
    if (w->code)
        return w;
    kmp_free(w);
    return NULL;
}

/* Goes over to machine code, with the inputs and the values of all earlier stages. Without memory the tape stays. */
static void change_to_native(waiting *w, int stage)
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

static void set_either(void *self, kmp_input_kind kind, const double *values)
{
    const waiting *w = self;
    w->now->set(w->code, kind, values);
}

static void run_either(void *self, int stage)
{
    waiting *w = self;
    if (w->left > 0) {
        w->left -= w->program->code[stage + 1] - w->program->code[stage];
        if (w->left <= 0)
            change_to_native(w, stage);
    }
    w->now->run(w->code, stage);
}

static const double *outputs_of_either(const void *self, int stage)
{
    const waiting *w = self;
    return w->now->outputs(w->code, stage);
}

static void count_either(const void *self, kmp_block_counts *counts)
{
    const waiting *w = self;
    w->now->count(w->code, counts);
    if (w->taped)
        kmp_backend_tape.count(w->taped, counts);
}

const kmp_backend *kmp_backend_waiting(const kmp_backend *backend)
{
    static const kmp_backend either = {"native",          prepare_either, release_either, set_either, run_either,
                                       outputs_of_either, count_either,   NULL,           false,      NULL};
    return backend == &kmp_backend_native ? &either : backend;
}
