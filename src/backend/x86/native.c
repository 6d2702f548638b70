/* SPDX-License-Identifier: BSD-3-Clause */
/* Machine code for the arithmetic between functions, in the program's order: the operations and the roundings of the
 * tape, so that the bits are its bits. Where the machine has no such code, or the system does not let it run, the code
 * is the tape's. */
#include "backend/compiled.h"
#include "base/memory.h"

typedef struct native {
    kmp_frame frame; /* first, as in the tape */
    kmp_code code;
} native;

/* -- construction ------------------------------------------------------------------------------------ */

static void release(void *code)
{
    native *n = code;
    if (n && n->frame.taped) {
        kmp_backend_tape.release(code);
    } else if (n) {
        kmp_frame_free(&n->frame);
        kmp_code_free(&n->code);
        kmp_free(n);
    }
}

/* false: no memory. Without pages there is no code. */
static bool make(native *n, const kmp_program *p, kmp_team *team)
{
    kmp_layout layout = {0};
    bool ok = kmp_layout_init(&layout, &n->frame, p, kmp_code_is_straight, 0, &kmp_backend_native, team) &&
              kmp_code_list(&n->code, &layout) && kmp_code_write(&n->code, &layout, KMP_X86_ONE);
    kmp_layout_free(&layout);
    kmp_arena_free(&n->code.list);
    return ok;
}

static void *share(const kmp_program *p, kmp_team *team)
{
    native *n = KMP_NEW(native, 1);
    bool ok = n && (!kmp_x86_runs(KMP_X86_ONE) || make(n, p, team));
    if (ok && n->code.pages)
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
        if (n->code.segment[g])
            n->code.segment[g](n->frame.v);
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

/* Runs the segments before the parts; the parts, shared with the thread pool; the segments after them. */
static void run_parts(native *n, const kmp_parting *parting, uint32_t stage)
{
    piece p = {n, parting->first + 1, stage};
    run_part(&p, -1);
    kmp_team_run(n->frame.team, parting->parts, run_part, &p);
    run_part(&p, parting->parts);
}

static void run(void *code, int stage)
{
    native *n = code;
    kmp_frame *f = &n->frame;
    if (f->taped) {
        kmp_backend_tape.run(code, stage);
        return;
    }
    const kmp_parting *parting = f->parting ? &f->parting[stage] : NULL;
    if (parting && parting->parts > 0)
        run_parts(n, parting, f->stage[stage]);
    else
        run_segments(n, f->stage[stage], f->stage[stage + 1]);
    kmp_frame_copies(f, stage);
}

const kmp_backend kmp_backend_native = {"native", prepare, release, kmp_frame_set, run, kmp_frame_outputs, share, NULL};
