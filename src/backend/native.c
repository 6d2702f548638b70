/* SPDX-License-Identifier: BSD-3-Clause */
/* Machine code for the arithmetic between functions, in the program's order: the operations and the roundings of the
 * tape, so that the bits are its bits. If the machine has no such code, or the system does not let it run, the tape
 * runs. */
#include "backend/prepared.h"
#include "backend/row_writer.h"
#include "base/memory.h"

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
static bool make(native *n, const kmp_program *p, kmp_team *team)
{
    const kmp_prepared *prepared = kmp_prepared_of(p, KMP_X86_ONE, team ? kmp_team_threads(team) : 0);
    if (!prepared || !prepared->code.pages)
        return prepared;
    n->segment = prepared->code.segment;
    return kmp_prepared_frame(prepared, &n->frame, team) && kmp_prepared_values(prepared, &n->frame);
}

static void *share(const kmp_program *p, kmp_team *team)
{
    native *n = KMP_NEW(native, 1);
    bool ok = n && (!kmp_x86_runs(KMP_X86_ONE) || make(n, p, team));
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

const kmp_backend kmp_backend_native = {"native",          prepare,         release, kmp_frame_set,   run,
                                        kmp_frame_outputs, kmp_frame_count, share,   kmp_row_code_of, NULL};
