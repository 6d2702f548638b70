/* SPDX-License-Identifier: BSD-3-Clause */
#include "backend/compiled.h"
#include "backend/x86/packs.h"
#include <string.h>

bool kmp_code_is_straight(const kmp_instruction *in)
{
    return in->op == KMP_OP_ADD || in->op == KMP_OP_MUL || in->op == KMP_OP_DIV ||
           (in->op == KMP_OP_SQRT && !(in->a & 1));
}

/* -- the operations ---------------------------------------------------------------------------------- */

typedef struct lister {
    kmp_code *code;
    const kmp_layout *layout;
    uint8_t *kept; /* by instruction: read outside its segment's arithmetic */
    uint32_t count;
} lister;

/* Values that are read by functions, by other segments, or at the end. */
static void find_kept(lister *b)
{
    const kmp_layout *l = b->layout;
    const kmp_program *p = l->program;
    for (int i = 0; i < p->code[p->stages]; i++) {
        uint32_t operand[3];
        for (int k = kmp_layout_operands(l, i, operand); k-- > 0;) {
            int j = kmp_layout_instruction(l, operand[k]);
            if (j >= 0 && (!kmp_code_is_straight(&p->instruction[i]) || !kmp_layout_together(l, i, j)))
                b->kept[j] = 1;
        }
    }
    for (int k = 0; k < p->outputs[p->stages]; k++)
        if (kmp_layout_instruction(l, p->output[k]) >= 0)
            b->kept[kmp_layout_instruction(l, p->output[k])] = 1;
}

kmp_x86_op kmp_code_op(const kmp_instruction *in)
{
    switch (in->op) {
    case KMP_OP_MUL:
        return KMP_X86_MUL;
    case KMP_OP_DIV:
        return KMP_X86_DIV;
    case KMP_OP_SQRT:
        return KMP_X86_SQRT;
    default:
        return in->b & 1 ? KMP_X86_SUB : KMP_X86_ADD;
    }
}

static void add_operation(void *self, int i)
{
    lister *b = self;
    const kmp_layout *l = b->layout;
    uint32_t operand[3] = {0};
    int count = kmp_layout_operands(l, i, operand);
    kmp_straight *s = &b->code->operations[b->count++];
    *s = (kmp_straight){.op = (uint16_t)kmp_code_op(&l->program->instruction[i]),
                        .d = kmp_layout_target(l, i),
                        .x = count > 1 ? kmp_layout_slot(l, operand[0]) : 0,
                        .y = kmp_layout_slot(l, operand[count > 1]),
                        .kept = b->kept[i]};
    if (count == 3) {
        s->z = kmp_layout_slot(l, operand[2]);
        s->op = operand[0] & 1 ? KMP_X86_SUB_PRODUCT : operand[2] & 1 ? KMP_X86_PRODUCT_SUB : KMP_X86_PRODUCT_ADD;
    }
}

bool kmp_code_list(kmp_code *code, kmp_layout *l)
{
    int count = l->program->code[l->program->stages];
    lister b = {.code = code, .layout = l, .kept = KMP_ARENA_NEW(&l->arena, uint8_t, count)};
    *code = (kmp_code){0};
    code->operations = KMP_ARENA_NEW(&code->list, kmp_straight, count);
    code->start = KMP_ARENA_NEW(&code->list, uint32_t, l->frame->segment_count + 1);
    if (!b.kept || code->list.failed)
        return false;
    find_kept(&b);
    kmp_layout_visit(l, add_operation, &b, &b.count, code->start);
    return true;
}

/* -- machine code ------------------------------------------------------------------------------------ */

/* A segment's operations as they are written. */
typedef struct piece {
    uint32_t count;
    const kmp_straight *operations;
} piece;

/* Makes room for pairs and for values that leave registers. */
static bool extend(kmp_frame *f, const kmp_packs *packs, uint32_t places)
{
    if (!kmp_frame_extend(f, packs->next - f->slots + places))
        return false;
    for (int k = 0; k < packs->constants; k++)
        memcpy(f->v + packs->constant[k].slot, packs->constant[k].value, sizeof packs->constant[k].value);
    return true;
}

/* USUAL_LENGTH: bytes of machine code of an operation, 5 to 9, with loads and stores. MOST_PACKED: larger programs run
 * from memory beyond the first cache, and the search for pairs takes longer than all else. */
enum { USUAL_LENGTH = 10, MOST_PACKED = 50000 };

static bool write_segments(const kmp_code *code, kmp_layout *l, kmp_x86 *x86, uint32_t *offset)
{
    kmp_registers registers;
    uint32_t segments = l->frame->segment_count, slots = l->frame->slots;
    kmp_packs packs = {.slots = slots, .next = slots};
    piece *pieces = KMP_ARENA_NEW(&l->arena, piece, segments);
    if (!pieces)
        return false;
    /* The pieces of all segments, and the longest one. */
    uint32_t longest = 0;
    for (uint32_t g = 0; g < segments; g++) {
        pieces[g] = (piece){code->start[g + 1] - code->start[g], code->operations + code->start[g]};
        longest = pieces[g].count > longest ? pieces[g].count : longest;
    }
    bool packs_pay = x86->form == KMP_X86_ONE && l->frame->threads == 0 && code->start[segments] <= MOST_PACKED;
    if (packs_pay) {
        /* Puts equal operations side by side. */
        const kmp_frame *f = l->frame;
        uint32_t constants = KMP_FIRST_SLOT + (uint32_t)l->program->constant_count;
        bool ok = kmp_packs_init(&packs, &l->arena, f->slots, f->v, KMP_FIRST_SLOT, constants);
        for (uint32_t g = 0; ok && g < segments; g++)
            ok = kmp_packs_make(&packs, &pieces[g].count, &pieces[g].operations);
        if (!ok)
            return false;
    }
    for (uint32_t g = 0; g < segments; g++)
        longest = pieces[g].count > longest ? pieces[g].count : longest;
    if (!kmp_registers_init(&registers, &l->arena, packs.slots, packs.next, longest, l->frame->threads > 0))
        return false;
    for (uint32_t g = 0; g < segments; g++) {
        offset[g] = pieces[g].count > 0 ? (uint32_t)x86->size : KMP_NO_ROUTINE;
        if (pieces[g].count > 0)
            kmp_registers_write(&registers, x86, pieces[g].count, pieces[g].operations);
    }
    return !x86->failed && x86->size < KMP_NO_ROUTINE && extend(l->frame, &packs, registers.used);
}

void kmp_code_at(const void *pages, uint32_t offset, void *routine)
{
    const char *at = (const char *)pages + offset;
    memcpy(routine, &at, sizeof at);
}

bool kmp_code_load(kmp_code *code, kmp_arena *arena, const void *bytes, size_t size, uint32_t segments,
                   const uint32_t *offset)
{
    code->segment = KMP_ARENA_NEW(arena, kmp_routine *, segments);
    code->pages = code->segment && size > 0 ? kmp_pages_new(bytes, size) : NULL;
    code->size = code->pages ? size : 0;
    for (uint32_t g = 0; code->pages && g < segments; g++)
        if (offset[g] != KMP_NO_ROUTINE)
            kmp_code_at(code->pages, offset[g], &code->segment[g]);
    return code->segment;
}

bool kmp_code_write(kmp_code *code, kmp_layout *l, kmp_x86_form form)
{
    uint32_t segments = l->frame->segment_count;
    kmp_x86 x86 = {.form = form, .expected = USUAL_LENGTH * (size_t)code->start[segments]};
    code->offset = KMP_ARENA_NEW(&l->frame->arena, uint32_t, segments);
    bool ok = code->offset && write_segments(code, l, &x86, code->offset) &&
              kmp_code_load(code, &l->frame->arena, x86.code, x86.size, segments, code->offset);
    kmp_x86_free(&x86);
    return ok;
}

void kmp_code_free(kmp_code *code)
{
    kmp_arena_free(&code->list);
    kmp_pages_free(code->pages, code->size);
    *code = (kmp_code){0};
}
