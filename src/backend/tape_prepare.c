/* SPDX-License-Identifier: BSD-3-Clause */
/* A tape from a program: values get slots, products are fused into the sums that alone read them, stages are cut into
 * segments where functions stand between. */
#include "backend/tape.h"
#include "base/memory.h"
#include <string.h>

/* What preparing needs besides the tape. Arrays by instruction. */
typedef struct builder {
    tape *t;
    const kmp_program *p;
    int leaves;
    uint32_t *depth;    /* segment, within the stage, in which a value appears */
    uint32_t *uses;     /* by instructions and outputs */
    uint8_t *fused;     /* a product that its only reader takes over */
    uint8_t *fuse_b;    /* a sum that takes over: 1 its first, 2 its second operand */
    uint32_t *negative; /* by constant: slot of its negative, 0 when none */
    int *stage_of;
    uint32_t *slot; /* by value */
} builder;

static bool is_record(uint8_t op)
{
    return op == KMP_OP_ADD || op == KMP_OP_MUL;
}

/* The instruction behind an operand, -1 for a leaf. */
static int instruction_of(const builder *b, uint32_t operand)
{
    int i = (int)(operand >> 1) - b->leaves;
    return i >= 0 ? i : -1;
}

static uint32_t slot_of(const builder *b, uint32_t operand)
{
    return b->slot[operand >> 1];
}

/* Segment in which an operand is known, seen from a stage: 0 for leaves and earlier stages. */
static uint32_t known(const builder *b, int stage, uint32_t operand)
{
    int i = instruction_of(b, operand);
    return i < 0 || b->stage_of[i] < stage ? 0 : b->depth[i];
}

static uint32_t depth_of(const builder *b, int i)
{
    const kmp_instruction *in = &b->p->instruction[i];
    uint32_t d = 0;
    for (int k = 0; k < kmp_op_arity((kmp_op)in->op); k++) {
        uint32_t e = known(b, b->stage_of[i], kmp_instruction_operand(in, k));
        d = d > e ? d : e;
    }
    return is_record(in->op) ? d : d + 1;
}

static void count_uses(builder *b)
{
    const kmp_program *p = b->p;
    for (int i = 0; i < p->code[p->stages]; i++) {
        const kmp_instruction *in = &p->instruction[i];
        for (int k = 0; k < kmp_op_arity((kmp_op)in->op); k++)
            if (instruction_of(b, kmp_instruction_operand(in, k)) >= 0)
                b->uses[instruction_of(b, kmp_instruction_operand(in, k))]++;
    }
    for (int k = 0; k < p->outputs[p->stages]; k++)
        if (instruction_of(b, p->output[k]) >= 0)
            b->uses[instruction_of(b, p->output[k])]++;
}

static bool is_constant(const builder *b, uint32_t operand)
{
    return (int)(operand >> 1) < b->p->constant_count;
}

/* Whether sum i may take over its operand, a product of its own segment that nobody else reads. A subtracted product
 * must have a constant factor, whose negative is then used. */
static bool can_fuse(const builder *b, int i, uint32_t operand)
{
    int k = instruction_of(b, operand);
    if (k < 0 || b->p->instruction[k].op != KMP_OP_MUL || b->uses[k] != 1 || b->stage_of[k] != b->stage_of[i] ||
        b->depth[k] != b->depth[i])
        return false;
    return !(operand & 1) || is_constant(b, b->p->instruction[k].a);
}

static void analyse(builder *b)
{
    const kmp_program *p = b->p;
    for (int s = 0; s < p->stages; s++)
        for (int i = p->code[s]; i < p->code[s + 1]; i++) {
            b->stage_of[i] = s;
            b->depth[i] = depth_of(b, i);
        }
    count_uses(b);
    for (int i = 0; i < p->code[p->stages]; i++) {
        const kmp_instruction *in = &p->instruction[i];
        if (in->op != KMP_OP_ADD)
            continue;
        /* The other operand is added as it is: it must carry no sign. */
        if (can_fuse(b, i, in->b))
            b->fuse_b[i] = 2;
        else if (!(in->b & 1) && can_fuse(b, i, in->a))
            b->fuse_b[i] = 1;
        if (b->fuse_b[i])
            b->fused[instruction_of(b, b->fuse_b[i] == 2 ? in->b : in->a)] = 1;
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

/* Slot of the negative of a constant; the slots after the instructions are kept for these. */
static uint32_t negative_slot(builder *b, uint32_t operand)
{
    uint32_t k = operand >> 1;
    if (!b->negative[k]) {
        b->negative[k] = b->t->slots++;
        b->t->v[b->negative[k]] = -b->p->constant[k];
    }
    return b->negative[k];
}

static void write_record(builder *b, int i)
{
    const kmp_instruction *in = &b->p->instruction[i];
    uint32_t d = slot_of(b, (uint32_t)(b->leaves + i) << 1), x = slot_of(b, in->a), y = slot_of(b, in->b);
    if (b->fused[i])
        return;
    if (in->op == KMP_OP_MUL) {
        put_record(b->t, d, x, y, SLOT_MINUS_ZERO);
    } else if (b->fuse_b[i]) {
        uint32_t product = b->fuse_b[i] == 2 ? in->b : in->a, other = b->fuse_b[i] == 2 ? x : y;
        const kmp_instruction *m = &b->p->instruction[instruction_of(b, product)];
        uint32_t factor = product & 1 ? negative_slot(b, m->a) : slot_of(b, m->a);
        put_record(b->t, d, factor, slot_of(b, m->b), other);
    } else if (in->b & 1) {
        put_record(b->t, d, y, SLOT_MINUS_ONE, x);
    } else {
        put_record(b->t, d, x, SLOT_ONE, y);
    }
}

/* Sine and cosine of one angle in one segment share an entry. */
static void write_angle(builder *b, int i, uint32_t first)
{
    tape *t = b->t;
    const kmp_instruction *in = &b->p->instruction[i];
    uint32_t x = slot_of(b, in->a), d = slot_of(b, (uint32_t)(b->leaves + i) << 1), k = first;
    while (k < t->angles && t->angle[k] != x)
        k++;
    if (k == t->angles) {
        t->angle[k] = x;
        t->sine[k] = t->cosine[k] = SLOT_WASTE;
        t->angles++;
    }
    if (in->op == KMP_OP_SIN)
        t->sine[k] = d;
    else
        t->cosine[k] = d;
}

/* The items of the list that an implicit instruction reads; operand[0] is where they begin. */
static void write_arguments(builder *b, special *s, const kmp_instruction *in)
{
    tape *t = b->t;
    uint32_t list = in->a;
    s->operand[0] = t->argument_count;
    for (int l = 0; l < b->p->block[in->b].arguments; l++) {
        const kmp_instruction *item = &b->p->instruction[instruction_of(b, list)];
        t->arguments[t->argument_count++] = (argument){slot_of(b, item->a), item->a & 1 ? -1 : 1};
        list = item->b;
    }
}

static void write_special(builder *b, int i, uint32_t first_angle)
{
    const kmp_instruction *in = &b->p->instruction[i];
    if (in->op == KMP_OP_SIN || in->op == KMP_OP_COS) {
        write_angle(b, i, first_angle);
        return;
    }
    special *s = &b->t->specials[b->t->special_count++];
    *s = (special){.op = in->op, .instruction = (uint32_t)i, .d = slot_of(b, (uint32_t)(b->leaves + i) << 1)};
    if (in->op == KMP_OP_IMPLICIT) {
        write_arguments(b, s, in);
        return;
    }
    for (int k = 0; k < kmp_op_arity((kmp_op)in->op); k++) {
        s->operand[k] = slot_of(b, kmp_instruction_operand(in, k));
        s->minus[k] = kmp_instruction_operand(in, k) & 1;
    }
}

/* Records of depth k, then the specials that appear in k + 1. */
static void write_segment(builder *b, int stage, uint32_t k)
{
    tape *t = b->t;
    uint32_t first_angle = t->angles;
    t->segments[t->segment_count++] = (segment){t->records, t->angles, t->special_count};
    for (int i = b->p->code[stage]; i < b->p->code[stage + 1]; i++)
        if (is_record(b->p->instruction[i].op) && b->depth[i] == k)
            write_record(b, i);
    for (int i = b->p->code[stage]; i < b->p->code[stage + 1]; i++)
        if (!is_record(b->p->instruction[i].op) && b->depth[i] == k + 1)
            write_special(b, i, first_angle);
}

static uint32_t deepest(const builder *b, int stage)
{
    uint32_t d = 0;
    for (int i = b->p->code[stage]; i < b->p->code[stage + 1]; i++)
        d = b->depth[i] > d ? b->depth[i] : d;
    return d;
}

static uint32_t count_segments(const builder *b)
{
    uint32_t count = 1; /* the end */
    for (int s = 0; s < b->p->stages; s++)
        count += deepest(b, s) + 1;
    return count;
}

static bool allocate_blocks(builder *b)
{
    tape *t = b->t;
    const kmp_program *p = b->p;
    size_t count = 0;
    for (int i = 0; i < p->code[p->stages]; i++)
        if (p->instruction[i].op == KMP_OP_IMPLICIT)
            count += (size_t)p->block[p->instruction[i].b].arguments;
    t->arguments = KMP_NEW(argument, count);
    t->solving = KMP_NEW(kmp_solving *, p->block_count);
    bool ok = t->arguments && t->solving;
    for (int k = 0; ok && k < p->block_count; k++)
        ok = (t->solving[k] = kmp_solving_new(&p->block[k])) != NULL;
    return ok;
}

static bool allocate_code(builder *b)
{
    tape *t = b->t;
    uint32_t code = (uint32_t)b->p->code[b->p->stages], outputs = (uint32_t)b->p->outputs[b->p->stages];
    t->slots = FIRST_SLOT + (uint32_t)b->leaves + code + outputs;
    uint32_t capacity = t->slots + (uint32_t)b->p->constant_count;
    t->v = KMP_NEW(double, capacity);
    if (capacity <= UINT16_MAX)
        t->narrow = KMP_NEW(record16, code);
    else
        t->wide = KMP_NEW(record32, code);
    t->specials = KMP_NEW(special, code);
    t->angle = KMP_NEW(uint32_t, code);
    t->sine = KMP_NEW(uint32_t, code);
    t->cosine = KMP_NEW(uint32_t, code);
    t->lane = KMP_NEW(double, 3 * code);
    t->segments = KMP_NEW(segment, count_segments(b));
    t->stage = KMP_NEW(uint32_t, b->p->stages + 1);
    t->copies = KMP_NEW(copy, outputs);
    t->copy_start = KMP_NEW(uint32_t, b->p->stages + 1);
    t->feeds = KMP_NEW(feed, b->p->input_count);
    return t->v && (t->narrow || t->wide) && t->specials && t->angle && t->sine && t->cosine && t->lane &&
           t->segments && t->stage && t->copies && t->copy_start && t->feeds;
}

/* Every value has its slot; an instruction that is an output of its own stage computes straight into its place among
 * the outputs, the other outputs are copied at the end of the stage. */
static void place_values(builder *b)
{
    tape *t = b->t;
    const kmp_program *p = b->p;
    uint32_t values = (uint32_t)(b->leaves + p->code[p->stages]), first = FIRST_SLOT + values, copies = 0;
    t->out = t->v + first;
    for (uint32_t k = 0; k < values; k++)
        b->slot[k] = FIRST_SLOT + k;
    for (int s = 0; s < p->stages; s++) {
        t->copy_start[s] = copies;
        for (int k = p->outputs[s]; k < p->outputs[s + 1]; k++) {
            uint32_t value = p->output[k] >> 1, to = first + (uint32_t)k;
            int i = instruction_of(b, p->output[k]);
            if (i >= 0 && !(p->output[k] & 1) && b->stage_of[i] == s && b->slot[value] < first)
                b->slot[value] = to;
            else
                t->copies[copies++] = (copy){value, to, p->output[k] & 1 ? -1 : 1};
        }
    }
    t->copy_start[p->stages] = copies;
    for (uint32_t k = 0; k < copies; k++)
        t->copies[k].from = b->slot[t->copies[k].from];
}

static void place_inputs(builder *b)
{
    const kmp_program *p = b->p;
    int count = 0;
    for (int kind = 0; kind < KMP_IN_COUNT; kind++) {
        b->t->feed_start[kind] = count;
        for (int k = 0; k < p->input_count; k++)
            if ((int)p->input[k].kind == kind)
                b->t->feeds[count++] = (feed){b->slot[p->constant_count + k], p->input[k].index};
    }
    b->t->feed_start[KMP_IN_COUNT] = count;
}

static void write_code(builder *b)
{
    tape *t = b->t;
    place_values(b);
    place_inputs(b);
    t->v[SLOT_ONE] = 1;
    t->v[SLOT_MINUS_ONE] = -1;
    t->v[SLOT_MINUS_ZERO] = -0.0;
    memcpy(t->v + FIRST_SLOT, b->p->constant, (size_t)b->p->constant_count * sizeof(double));
    for (int s = 0; s < b->p->stages; s++) {
        t->stage[s] = t->segment_count;
        for (uint32_t k = 0; k <= deepest(b, s); k++)
            write_segment(b, s, k);
    }
    t->stage[b->p->stages] = t->segment_count;
    t->segments[t->segment_count] = (segment){t->records, t->angles, t->special_count};
}

static bool begin(builder *b, const kmp_program *p)
{
    int code = p->code[p->stages];
    b->p = p;
    b->leaves = p->constant_count + p->input_count;
    b->t = KMP_NEW(tape, 1);
    b->depth = KMP_NEW(uint32_t, code);
    b->uses = KMP_NEW(uint32_t, code);
    b->fused = KMP_NEW(uint8_t, code);
    b->fuse_b = KMP_NEW(uint8_t, code);
    b->negative = KMP_NEW(uint32_t, p->constant_count);
    b->stage_of = KMP_NEW(int, code);
    b->slot = KMP_NEW(uint32_t, b->leaves + code);
    return b->t && b->depth && b->uses && b->fused && b->fuse_b && b->negative && b->stage_of && b->slot;
}

void kmp_tape_release(void *code)
{
    tape *t = code;
    if (!t)
        return;
    kmp_free(t->v);
    kmp_free(t->narrow);
    kmp_free(t->wide);
    kmp_free(t->specials);
    kmp_free(t->angle);
    kmp_free(t->sine);
    kmp_free(t->cosine);
    kmp_free(t->lane);
    kmp_free(t->segments);
    kmp_free(t->stage);
    kmp_free(t->copies);
    kmp_free(t->copy_start);
    kmp_free(t->feeds);
    for (int k = 0; t->solving && k < t->program->block_count; k++)
        kmp_solving_free(t->solving[k]);
    kmp_free(t->solving);
    kmp_free(t->arguments);
    kmp_free(t);
}

void *kmp_tape_prepare(const kmp_program *p)
{
    builder b = {0};
    bool ok = begin(&b, p);
    if (ok) {
        b.t->program = p;
        analyse(&b);
        ok = allocate_code(&b) && allocate_blocks(&b);
    }
    if (ok)
        write_code(&b);
    kmp_free(b.depth);
    kmp_free(b.uses);
    kmp_free(b.fused);
    kmp_free(b.fuse_b);
    kmp_free(b.negative);
    kmp_free(b.stage_of);
    kmp_free(b.slot);
    if (ok)
        return b.t;
    kmp_tape_release(b.t);
    return NULL;
}
