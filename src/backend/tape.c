/* SPDX-License-Identifier: BSD-3-Clause */
/* The branch-free tape: every add, subtract and multiply is v[d] = v[a] * v[b] + v[c], so that there is no opcode to
 * mispredict:
 *
 *     x + y = x * 1 + y      x - y = y * (-1) + x      x * y = x * y + (-0)      -x = x * (-1) + (-0)
 *
 * with one rounding where the program contracts, otherwise with two; all equal to the last bit. Products that are part
 * of a sum (symbolic/contraction.h) have no separate record. Slots are 16 bits wide when they suffice, 32
 * otherwise. */
#include "backend/prepared.h"
#include "backend/wasm/relaxed_sums.h"
#include "base/clones.h"
#include "base/memory.h"
#include <math.h>

typedef struct record16 {
    uint16_t d, a, b, c;
} record16;

typedef struct record32 {
    uint32_t d, a, b, c;
} record32;

/* The part that all tapes of a program share; its arrays lie in the memory of its frame. */
typedef struct records {
    kmp_prepared prepared; /* first */
    record16 *narrow;      /* either this or `wide` is used */
    record32 *wide;
    uint32_t count, *start; /* first record of each segment, and the end */
} records;

typedef struct tape {
    kmp_frame frame; /* first */
    const records *records;
} tape;

enum { TAPE_FORM = 0 }; /* others are numbers of lanes */

/* -- construction ------------------------------------------------------------------------------------ */

typedef struct builder {
    records *t;
    kmp_layout layout;
    uint32_t *negative; /* by constant: slot of its negative, 0 when none */
} builder;

static bool is_record(const kmp_instruction *in)
{
    return in->op == KMP_OP_ADD || in->op == KMP_OP_MUL;
}

static void put_record(records *t, uint32_t d, uint32_t a, uint32_t b, uint32_t c)
{
    if (t->narrow)
        t->narrow[t->count] = (record16){(uint16_t)d, (uint16_t)a, (uint16_t)b, (uint16_t)c};
    else
        t->wide[t->count] = (record32){d, a, b, c};
    t->count++;
}

/* Slot of an operand with its sign; the negative of a value is computed in `room`. */
static uint32_t signed_slot(builder *b, uint32_t operand, uint32_t room)
{
    uint32_t slot = kmp_layout_slot(&b->layout, operand);
    if (!(operand & 1))
        return slot;
    if ((int)(operand >> 1) < b->layout.program->constant_count) {
        /* Slot of the negative of a constant, among the tape's own slots. */
        uint32_t k = operand >> 1;
        kmp_frame *f = &b->t->prepared.frame;
        if (!b->negative[k]) {
            b->negative[k] = f->slots++;
            f->v[b->negative[k]] = -f->program->constant[k];
        }
        return b->negative[k];
    }
    put_record(b->t, room, slot, KMP_SLOT_MINUS_ONE, KMP_SLOT_MINUS_ZERO);
    return room;
}

/* The slot of the product is free for a negative operand, of which there is at most one. */
static void write_multiply_add(builder *b, int i, uint32_t d)
{
    const kmp_layout *l = &b->layout;
    kmp_multiply_add m = kmp_multiply_add_of(l->program, i, (kmp_contraction)l->contraction[i]);
    uint32_t room = kmp_layout_target(l, (int)m.product), x = m.x, y = m.y;
    if (x & 1 && (int)(y >> 1) < l->program->constant_count) {
        x = m.y | 1;
        y = m.x & ~1u;
    }
    uint32_t first = signed_slot(b, x, room), last = signed_slot(b, m.z, room);
    put_record(b->t, d, first, kmp_layout_slot(l, y), last);
}

static void write_record(void *self, int i)
{
    builder *b = self;
    const kmp_layout *l = &b->layout;
    const kmp_instruction *in = &l->program->instruction[i];
    uint32_t d = kmp_layout_target(l, i), x = kmp_layout_slot(l, in->a), y = kmp_layout_slot(l, in->b);
    if (l->contraction[i] != KMP_ALONE)
        write_multiply_add(b, i, d);
    else if (in->op == KMP_OP_MUL)
        put_record(b->t, d, x, y, KMP_SLOT_MINUS_ZERO);
    else if (in->b & 1)
        put_record(b->t, d, y, KMP_SLOT_MINUS_ONE, x);
    else
        put_record(b->t, d, x, KMP_SLOT_ONE, y);
}

static bool begin(builder *b, const kmp_program *p)
{
    int code = p->code[p->stages];
    records *t = b->t;
    kmp_frame *f = &t->prepared.frame;
    if (!kmp_layout_init(&b->layout, f, p, is_record, (uint32_t)p->constant_count, NULL, 0))
        return false;
    kmp_arena *own = &b->layout.arena, *a = &f->arena;
    f->taped = true;
    b->negative = KMP_ARENA_NEW(own, uint32_t, p->constant_count);
    if (!p->contraction)
        b->layout.contraction = kmp_program_contraction(p, 0, 0, own);
    if (f->slots + (uint32_t)p->constant_count <= UINT16_MAX)
        t->narrow = KMP_ARENA_NEW(a, record16, code);
    else
        t->wide = KMP_ARENA_NEW(a, record32, code);
    t->start = KMP_ARENA_NEW(a, uint32_t, f->segment_count + 1);
    return !own->failed && !a->failed;
}

static void release(void *code)
{
    tape *t = code;
    if (t)
        kmp_frame_free(&t->frame);
    kmp_free(t);
}

static void release_records(kmp_program_form *form)
{
    records *t = (records *)form;
    kmp_frame_free(&t->prepared.frame);
    kmp_free(t);
}

static records *make_records(const kmp_program *p)
{
    builder b = {.t = KMP_NEW(records, 1)};
    if (!b.t)
        return NULL;
    b.t->prepared.form = (kmp_program_form){.kind = TAPE_FORM, .release = release_records};
    bool ok = begin(&b, p);
    if (ok)
        kmp_layout_visit(&b.layout, write_record, &b, &b.t->count, b.t->start);
    kmp_layout_free(&b.layout);
    if (ok && kmp_prepared_take_start(&b.t->prepared))
        return b.t;
    release_records(&b.t->prepared.form);
    return NULL;
}

/* The parts that all tapes of the program share, made by the first call. */
static const records *records_of(const kmp_program *p)
{
    kmp_program_form *found = kmp_program_find_form(p, TAPE_FORM);
    if (found)
        return (const records *)found;
    records *made = make_records(p);
    return made ? (const records *)kmp_program_add_form(p, &made->prepared.form) : NULL;
}

static void *prepare(const kmp_program *p)
{
    tape *t = KMP_NEW(tape, 1);
    const records *shared = t ? records_of(p) : NULL;
    if (shared && kmp_prepared_frame(&shared->prepared, &t->frame, NULL) &&
        kmp_prepared_values(&shared->prepared, &t->frame)) {
        t->records = shared;
        return t;
    }
    release(t);
    return NULL;
}

/* -- run --------------------------------------------------------------------------------------------- */

#define RUN(value)                                                                                                     \
    if (t->narrow)                                                                                                     \
        for (const record16 *r = t->narrow + t->start[g], *end = t->narrow + t->start[g + 1]; r < end; r++)            \
            v[r->d] = value;                                                                                           \
    else                                                                                                               \
        for (const record32 *r = t->wide + t->start[g], *end = t->wide + t->start[g + 1]; r < end; r++)                \
        v[r->d] = value

/* The records of a segment. */
static void run_rounded_twice(const records *t, uint32_t g, double *v)
{
    RUN(v[r->a] * v[r->b] + v[r->c]);
}

static void run_rounded_once(const records *t, uint32_t g, double *v)
{
    RUN(fma(v[r->a], v[r->b], v[r->c]));
}

KMP_MULTIPLY_ADD static void run_multiply_add(const records *t, uint32_t g, double *v)
{
    RUN(fma(v[r->a], v[r->b], v[r->c]));
}

static void run_relaxed(const kmp_relaxed_sums *sums, const records *t, uint32_t g, double *v)
{
    if (t->narrow)
        sums->narrow(t->narrow + t->start[g], t->narrow + t->start[g + 1], v);
    else
        sums->wide(t->wide + t->start[g], t->wide + t->start[g + 1], v);
}

static void run(void *code, int stage)
{
    tape *t = code;
    kmp_frame *f = &t->frame;
    const kmp_relaxed_sums *sums = kmp_relaxed_sums_here();
    for (uint32_t g = f->stage[stage]; g < f->stage[stage + 1]; g++) {
        if (!f->program->contraction)
            run_rounded_twice(t->records, g, f->v);
        else if (sums)
            run_relaxed(sums, t->records, g, f->v);
        else
            (kmp_has_multiply_add() ? run_multiply_add : run_rounded_once)(t->records, g, f->v);
        kmp_frame_functions(f, g);
    }
    kmp_frame_copies(f, stage);
}

const kmp_backend kmp_backend_tape = {"tape",          prepare, release, kmp_frame_set, run, kmp_frame_outputs,
                                      kmp_frame_count, NULL,    false,   NULL};
