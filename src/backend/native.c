/* SPDX-License-Identifier: BSD-3-Clause */
/* Machine code for the arithmetic between functions, in the program's order: the operations and the roundings of the
 * tape, so that the bits are its bits. Where the machine has no such code, or the system does not let it run, the tape
 * takes the program. */
#include "backend/layout.h"
#include "backend/pages.h"
#include "backend/registers.h"
#include "base/memory.h"
#include <string.h>

typedef void routine(double *v);

typedef struct native {
    kmp_frame frame; /* first */
    void *tape;      /* what runs instead; then there is nothing else */
    void *pages;
    size_t size;
    routine **segment; /* its arithmetic; NULL: it has none */
} native;

/* -- making it --------------------------------------------------------------------------------------- */

typedef struct builder {
    native *n;
    kmp_layout layout;
    uint32_t *segment_of; /* by instruction */
    uint8_t *kept;        /* by instruction: read outside its segment's arithmetic */
    kmp_straight *operations;
    uint32_t *start; /* first operation of each segment, and the end */
    uint32_t count;
    size_t *offset; /* of each segment's code */
    kmp_x86 code;
    kmp_registers registers;
} builder;

static bool is_straight(const kmp_instruction *in)
{
    return in->op == KMP_OP_ADD || in->op == KMP_OP_MUL || in->op == KMP_OP_DIV ||
           (in->op == KMP_OP_SQRT && !(in->a & 1));
}

static void note_segment(void *self, uint32_t segment, int i)
{
    builder *b = self;
    b->segment_of[i] = segment;
}

/* Values that are read by functions, by other segments, or at the end. */
static void find_kept(builder *b)
{
    const kmp_layout *l = &b->layout;
    const kmp_program *p = l->program;
    for (int i = 0; i < p->code[p->stages]; i++) {
        const kmp_instruction *in = &p->instruction[i];
        for (int k = 0; k < kmp_op_arity((kmp_op)in->op); k++) {
            int j = kmp_layout_instruction(l, kmp_instruction_operand(in, k));
            if (j >= 0 && (!is_straight(in) || b->segment_of[i] != b->segment_of[j]))
                b->kept[j] = 1;
        }
    }
    for (int k = 0; k < p->outputs[p->stages]; k++)
        if (kmp_layout_instruction(l, p->output[k]) >= 0)
            b->kept[kmp_layout_instruction(l, p->output[k])] = 1;
}

static void add_operation(void *self, uint32_t segment, int i)
{
    builder *b = self;
    const kmp_layout *l = &b->layout;
    const kmp_instruction *in = &l->program->instruction[i];
    bool unary = in->op == KMP_OP_SQRT;
    kmp_x86_op op = in->op == KMP_OP_MUL   ? KMP_X86_MUL
                    : in->op == KMP_OP_DIV ? KMP_X86_DIV
                    : unary                ? KMP_X86_SQRT
                    : in->b & 1            ? KMP_X86_SUB
                                           : KMP_X86_ADD;
    b->operations[b->count++] = (kmp_straight){.op = op,
                                               .d = kmp_layout_target(l, i),
                                               .x = unary ? 0 : kmp_layout_slot(l, in->a),
                                               .y = kmp_layout_slot(l, unary ? in->a : in->b),
                                               .kept = b->kept[i]};
    b->start[segment + 1] = b->count;
}

/* The operations of all segments. */
static void list_operations(builder *b)
{
    kmp_layout_visit(&b->layout, note_segment, b);
    find_kept(b);
    kmp_layout_visit(&b->layout, add_operation, b);
    for (uint32_t g = 0; g < b->n->frame.segment_count; g++)
        if (b->start[g + 1] < b->start[g])
            b->start[g + 1] = b->start[g];
}

static bool write_code(builder *b)
{
    uint32_t segments = b->n->frame.segment_count, longest = 0;
    for (uint32_t g = 0; g < segments; g++)
        longest = b->start[g + 1] - b->start[g] > longest ? b->start[g + 1] - b->start[g] : longest;
    if (!kmp_registers_init(&b->registers, b->n->frame.slots, longest))
        return false;
    for (uint32_t g = 0; g < segments; g++) {
        b->offset[g] = b->code.size;
        if (b->start[g + 1] > b->start[g])
            kmp_registers_write(&b->registers, &b->code, b->start[g + 1] - b->start[g], b->operations + b->start[g]);
    }
    return !b->code.failed;
}

/* C has no way to make a function of an object's address but copying. */
static routine *routine_at(const builder *b, uint32_t segment)
{
    routine *code = NULL;
    const char *at = (const char *)b->n->pages + b->offset[segment];
    if (b->start[segment + 1] > b->start[segment])
        memcpy(&code, &at, sizeof code);
    return code;
}

static bool begin(builder *b, const kmp_program *p)
{
    int code = p->code[p->stages];
    b->segment_of = KMP_NEW(uint32_t, code);
    b->kept = KMP_NEW(uint8_t, code);
    b->operations = KMP_NEW(kmp_straight, code);
    if (!b->segment_of || !b->kept || !b->operations || !kmp_layout_init(&b->layout, &b->n->frame, p, is_straight, 0))
        return false;
    b->start = KMP_NEW(uint32_t, b->n->frame.segment_count + 1);
    b->offset = KMP_NEW(size_t, b->n->frame.segment_count);
    b->n->segment = KMP_NEW(routine *, b->n->frame.segment_count);
    return b->start && b->offset && b->n->segment;
}

static void end(builder *b)
{
    kmp_layout_free(&b->layout);
    kmp_registers_free(&b->registers);
    kmp_x86_free(&b->code);
    kmp_free(b->segment_of);
    kmp_free(b->kept);
    kmp_free(b->operations);
    kmp_free(b->start);
    kmp_free(b->offset);
}

static void drop_code(native *n)
{
    kmp_frame_free(&n->frame);
    kmp_pages_free(n->pages, n->size);
    kmp_free(n->segment);
    *n = (native){.tape = n->tape};
}

static void release(void *code)
{
    native *n = code;
    if (!n)
        return;
    if (n->tape)
        kmp_backend_tape.release(n->tape);
    drop_code(n);
    kmp_free(n);
}

/* false: no memory. Without pages there is no code. */
static bool make(native *n, const kmp_program *p)
{
    builder b = {.n = n, .code = {.form = KMP_X86_ONE}};
    bool ok = begin(&b, p);
    if (ok) {
        list_operations(&b);
        ok = write_code(&b);
    }
    if (ok && b.code.size > 0) {
        n->size = b.code.size;
        n->pages = kmp_pages_new(b.code.code, n->size);
    }
    for (uint32_t g = 0; ok && n->pages && g < n->frame.segment_count; g++)
        n->segment[g] = routine_at(&b, g);
    end(&b);
    return ok;
}

static void *prepare(const kmp_program *p)
{
    native *n = KMP_NEW(native, 1);
    if (!n)
        return NULL;
    bool ok = !kmp_x86_runs(KMP_X86_ONE) || make(n, p);
    if (ok && !n->pages) {
        drop_code(n);
        n->tape = kmp_backend_tape.prepare(p);
        ok = n->tape;
    }
    if (ok)
        return n;
    release(n);
    return NULL;
}

/* -- running it -------------------------------------------------------------------------------------- */

static void set(void *code, kmp_input_kind kind, const double *values)
{
    native *n = code;
    if (n->tape)
        kmp_backend_tape.set(n->tape, kind, values);
    else
        kmp_frame_set(n, kind, values);
}

static void run(void *code, int stage)
{
    native *n = code;
    kmp_frame *f = &n->frame;
    if (n->tape) {
        kmp_backend_tape.run(n->tape, stage);
        return;
    }
    for (uint32_t g = f->stage[stage]; g < f->stage[stage + 1]; g++) {
        if (n->segment[g])
            n->segment[g](f->v);
        kmp_frame_functions(f, g);
    }
    kmp_frame_copies(f, stage);
}

static const double *outputs(const void *code, int stage)
{
    const native *n = code;
    return n->tape ? kmp_backend_tape.outputs(n->tape, stage) : kmp_frame_outputs(n, stage);
}

const kmp_backend kmp_backend_native = {"native", prepare, release, set, run, outputs};
