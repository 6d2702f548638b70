/* SPDX-License-Identifier: BSD-3-Clause */
/* The branch-free tape: every add, subtract and multiply is v[d] = v[a] * v[b] + v[c] with two roundings, so that there
 * is no opcode to mispredict:
 *
 *     x + y = x * 1 + y      x - y = y * (-1) + x      x * y = x * y + (-0)      x + p * q = p * q + x
 *
 * all equal to the last bit. Products with a single reader are fused into the sum that reads them. Slots are 16 bits
 * wide when they suffice, 32 otherwise. */
#include "backend/layout.h"
#include "base/memory.h"

typedef struct record16 {
    uint16_t d, a, b, c;
} record16;

typedef struct record32 {
    uint32_t d, a, b, c;
} record32;

typedef struct tape {
    kmp_frame frame;  /* first */
    record16 *narrow; /* either this or `wide` is used */
    record32 *wide;
    uint32_t records, *start; /* first record of each segment, and the end */
} tape;

/* -- construction ------------------------------------------------------------------------------------ */

/* Arrays by instruction. */
typedef struct builder {
    tape *t;
    kmp_layout layout;
    uint32_t *uses;     /* by instruction: the number of instructions and outputs that read it */
    uint8_t *fused;     /* a product that its only reader takes over */
    uint8_t *fuse_b;    /* a sum that takes over: 1 its first, 2 its second operand */
    uint32_t *negative; /* by constant: slot of its negative, 0 when none */
} builder;

static bool is_record(const kmp_instruction *in)
{
    return in->op == KMP_OP_ADD || in->op == KMP_OP_MUL;
}

static bool is_constant(const builder *b, uint32_t operand)
{
    return (int)(operand >> 1) < b->layout.program->constant_count;
}

/* True if sum i may absorb its operand, a product of its own segment without other readers. A subtracted product must
 * have a constant factor, whose negative is then used. */
static bool can_fuse(const builder *b, int i, uint32_t operand)
{
    int k = kmp_layout_instruction(&b->layout, operand);
    if (k < 0 || b->layout.program->instruction[k].op != KMP_OP_MUL || b->uses[k] != 1 ||
        !kmp_layout_together(&b->layout, k, i))
        return false;
    return !(operand & 1) || is_constant(b, b->layout.program->instruction[k].a);
}

static void count_uses(builder *b)
{
    const kmp_program *p = b->layout.program;
    for (int i = 0; i < p->code[p->stages]; i++) {
        const kmp_instruction *in = &p->instruction[i];
        for (int k = 0; k < kmp_op_arity((kmp_op)in->op); k++) {
            int read = kmp_layout_instruction(&b->layout, kmp_instruction_operand(in, k));
            if (read >= 0)
                b->uses[read]++;
        }
    }
    for (int k = 0; k < p->outputs[p->stages]; k++) {
        int read = kmp_layout_instruction(&b->layout, p->output[k]);
        if (read >= 0)
            b->uses[read]++;
    }
}

static void fuse(builder *b)
{
    const kmp_program *p = b->layout.program;
    count_uses(b);
    for (int i = 0; i < p->code[p->stages]; i++) {
        const kmp_instruction *in = &p->instruction[i];
        if (in->op != KMP_OP_ADD)
            continue;
        /* The other operand is added unchanged: it must have no sign. */
        if (can_fuse(b, i, in->b))
            b->fuse_b[i] = 2;
        else if (!(in->b & 1) && can_fuse(b, i, in->a))
            b->fuse_b[i] = 1;
        if (b->fuse_b[i])
            b->fused[kmp_layout_instruction(&b->layout, b->fuse_b[i] == 2 ? in->b : in->a)] = 1;
    }
}

static void put_record(tape *t, uint32_t d, uint32_t a, uint32_t b, uint32_t c)
{
    if (t->narrow)
        t->narrow[t->records] = (record16){(uint16_t)d, (uint16_t)a, (uint16_t)b, (uint16_t)c};
    else
        t->wide[t->records] = (record32){d, a, b, c};
    t->records++;
}

/* Slot of the negative of a constant, among the tape's own slots. */
static uint32_t negative_slot(builder *b, uint32_t operand)
{
    uint32_t k = operand >> 1;
    kmp_frame *f = &b->t->frame;
    if (!b->negative[k]) {
        b->negative[k] = f->slots++;
        f->v[b->negative[k]] = -f->program->constant[k];
    }
    return b->negative[k];
}

static void write_record(void *self, int i)
{
    builder *b = self;
    const kmp_layout *l = &b->layout;
    const kmp_instruction *in = &l->program->instruction[i];
    uint32_t d = kmp_layout_target(l, i), x = kmp_layout_slot(l, in->a), y = kmp_layout_slot(l, in->b);
    if (b->fused[i])
        return;
    if (in->op == KMP_OP_MUL) {
        put_record(b->t, d, x, y, KMP_SLOT_MINUS_ZERO);
    } else if (b->fuse_b[i]) {
        uint32_t product = b->fuse_b[i] == 2 ? in->b : in->a, other = b->fuse_b[i] == 2 ? x : y;
        const kmp_instruction *m = &l->program->instruction[kmp_layout_instruction(l, product)];
        uint32_t factor = product & 1 ? negative_slot(b, m->a) : kmp_layout_slot(l, m->a);
        put_record(b->t, d, factor, kmp_layout_slot(l, m->b), other);
    } else if (in->b & 1) {
        put_record(b->t, d, y, KMP_SLOT_MINUS_ONE, x);
    } else {
        put_record(b->t, d, x, KMP_SLOT_ONE, y);
    }
}

static bool begin(builder *b, const kmp_program *p)
{
    int code = p->code[p->stages];
    tape *t = b->t;
    if (!kmp_layout_init(&b->layout, &t->frame, p, is_record, (uint32_t)p->constant_count, NULL, NULL) ||
        !kmp_frame_add_blocks(&t->frame))
        return false;
    kmp_arena *own = &b->layout.arena, *a = &t->frame.arena;
    t->frame.taped = true;
    b->uses = KMP_ARENA_NEW(own, uint32_t, code);
    b->fused = KMP_ARENA_NEW(own, uint8_t, code);
    b->fuse_b = KMP_ARENA_NEW(own, uint8_t, code);
    b->negative = KMP_ARENA_NEW(own, uint32_t, p->constant_count);
    if (t->frame.slots + (uint32_t)p->constant_count <= UINT16_MAX)
        t->narrow = KMP_ARENA_NEW(a, record16, code);
    else
        t->wide = KMP_ARENA_NEW(a, record32, code);
    t->start = KMP_ARENA_NEW(a, uint32_t, t->frame.segment_count + 1);
    return !own->failed && !a->failed;
}

static void release(void *code)
{
    tape *t = code;
    if (t)
        kmp_frame_free(&t->frame);
    kmp_free(t);
}

static void *prepare(const kmp_program *p)
{
    builder b = {.t = KMP_NEW(tape, 1)};
    bool ok = b.t && begin(&b, p);
    if (ok) {
        fuse(&b);
        kmp_layout_visit(&b.layout, write_record, &b, &b.t->records, b.t->start);
    }
    kmp_layout_free(&b.layout);
    if (ok)
        return b.t;
    release(b.t);
    return NULL;
}

/* -- run --------------------------------------------------------------------------------------------- */

static void run_narrow(const record16 *r, const record16 *end, double *v)
{
    for (; r < end; r++)
        v[r->d] = v[r->a] * v[r->b] + v[r->c];
}

static void run_wide(const record32 *r, const record32 *end, double *v)
{
    for (; r < end; r++)
        v[r->d] = v[r->a] * v[r->b] + v[r->c];
}

static void run(void *code, int stage)
{
    tape *t = code;
    kmp_frame *f = &t->frame;
    for (uint32_t g = f->stage[stage]; g < f->stage[stage + 1]; g++) {
        if (t->narrow)
            run_narrow(t->narrow + t->start[g], t->narrow + t->start[g + 1], f->v);
        else
            run_wide(t->wide + t->start[g], t->wide + t->start[g + 1], f->v);
        kmp_frame_functions(f, g);
    }
    kmp_frame_copies(f, stage);
}

const kmp_backend kmp_backend_tape = {"tape", prepare, release, kmp_frame_set, run, kmp_frame_outputs, NULL, NULL};
