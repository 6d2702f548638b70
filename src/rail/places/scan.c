/* SPDX-License-Identifier: BSD-3-Clause */
/* A value is a row of doubles, one per place, padded to a multiple of eight; a value that is equal at all places
 * is only eight doubles. Values that depend on arguments are in the first slots of their rows, which the cache of the
 * processor keeps; it would not keep whole rows. */
#include "rail/places/scan.h"
#include "base/arena.h"
#include "base/clones.h"
#include "base/memory.h"
#include "base/simd4.h"
#include "rail/places/row_code.h"
#include "rail/places/table_rows.h"
#include "symbolic/interpreter.h"
#include <math.h>
#include <string.h>

enum { LANES = KMP_SCAN_GROUP, FIRST = KMP_ROW_FIRST, LAST = KMP_ROW_LAST };

/* Dependence of a value: on constants, only on the arguments, on both arguments and place. */
typedef enum need { STANDING, COMMON, MOVING } need;

/* An instruction to be run, or to find the pieces of a table that a value is in, which all instructions that look it up
 * there share. Operands that it has not are the first. */
typedef struct step {
    uint8_t op;
    bool finds;
    int kernel, instruction;
    kmp_scan_row x, y, z;
    double *to;
    const kmp_table *table;
    int *piece;    /* by slot */
    double *slope; /* by slot: the first derivative of a table, where a later step has it; that step does nothing */
    kmp_row_routine *routine; /* machine code of several instructions; `to`, x and y are then its arguments */
    size_t lanes;             /* that a call of it computes */
} step;

struct kmp_scan {
    const kmp_program *p;
    kmp_arena arena;        /* of all arrays */
    size_t width;           /* places, filled up */
    kmp_interpreter *first; /* stage 0 */
    double *merit;
    double **row; /* by value */
    double *base[KMP_ROW_BASES];
    kmp_row_address *address; /* by value: of its row */
    const kmp_row_code *code; /* NULL: there is none */
    uint8_t *need;            /* by value */
    int *common;              /* the values that the stages read */
    int common_count;
    step *steps;
    int step_start[LAST + 2];  /* by stage */
    kmp_counts once[LAST + 1]; /* operations of a stage at one place */
    int *pieces;
    size_t *every;                 /* first of each group of eight */
    long settings, runs[LAST + 1]; /* sets of arguments; groups that a stage ran in */
};

static int leaves(const kmp_program *p)
{
    return p->constant_count + p->input_count;
}

/* True if a value is eight doubles long: numbers and functions only of arguments. */
static bool is_short(const kmp_scan *s, uint32_t value)
{
    return s->need[value] == COMMON || (int)value < s->p->constant_count;
}

static kmp_scan_row row_of(const kmp_scan *s, uint32_t operand)
{
    uint32_t value = operand >> 1;
    bool whole = !is_short(s, value), moving = s->need[value] == MOVING;
    return (kmp_scan_row){s->row[value], whole && !moving ? SIZE_MAX : 0, whole && moving ? SIZE_MAX : 0,
                          operand & 1 ? -1 : 1};
}

/* -- running instructions ---------------------------------------------------------------------------- */

/* The groups of eight that are run, and the slots of the first of them. */
typedef struct groups {
    size_t count;
    const size_t *first;
    size_t slot;
} groups;

/* The same, with an eight of each operand from x, y, z on, and `to`. */
#define EACH(s, n)                                                                                                     \
    const kmp_scan_row rows[3] = {(s)->x, (s)->y, (s)->z};                                                             \
    const size_t count = (n)->count, *const first = (n)->first;                                                        \
    double *to = (s)->to + (n)->slot;                                                                                  \
    for (size_t group = 0, slot = (n)->slot; group < count; group++, slot += LANES, to += LANES)

/* to = value of x, y, z in all groups. A sign is a factor, which changes no bit else. */
#define ALONG(s, n, value)                                                                                             \
    {                                                                                                                  \
        EACH(s, n)                                                                                                     \
        {                                                                                                              \
            const kmp_eight x = KMP_EIGHT_CONST(kmp_scan_at(&rows[0], first[group], slot));                            \
            const kmp_eight y = KMP_EIGHT_CONST(kmp_scan_at(&rows[1], first[group], slot));                            \
            (void)y;                                                                                                   \
            KMP_EIGHT_AT(to) = (value);                                                                                \
        }                                                                                                              \
    }

/* The same by fours: compilers compare eights one by one. */
#define ALONG_FOURS(s, n, value)                                                                                       \
    {                                                                                                                  \
        EACH(s, n)                                                                                                     \
        for (size_t half = 0; half < LANES; half += KMP_FOUR) {                                                        \
            const kmp_four x = KMP_FOUR_CONST(kmp_scan_at(&rows[0], first[group], slot) + half);                       \
            const kmp_four y = KMP_FOUR_CONST(kmp_scan_at(&rows[1], first[group], slot) + half);                       \
            const kmp_four z = KMP_FOUR_CONST(kmp_scan_at(&rows[2], first[group], slot) + half);                       \
            (void)z;                                                                                                   \
            KMP_FOUR_AT(to + half) = (value);                                                                          \
        }                                                                                                              \
    }

/* Sums and products, each for all kinds of operands: x and y depend only on arguments (ONE), are by place, or by slot.
 */
#define OF_ONE(row)   KMP_EIGHT_CONST(row)
#define OF_PLACE(row) KMP_EIGHT_CONST((row) + n->first[group])
#define OF_SLOT(row)  KMP_EIGHT_CONST((row) + slot)
#define KERNEL(form, kinds, X, Y, value)                                                                               \
    case KERNELS *(form) + (kinds): {                                                                                  \
        const double *const at_x = s->x.row, *const at_y = s->y.row;                                                   \
        double *const to = s->to;                                                                                      \
        for (size_t group = 0, slot = n->slot; group < n->count; group++, slot += LANES) {                             \
            const kmp_eight x = X(at_x), y = Y(at_y);                                                                  \
            KMP_EIGHT_AT(to + slot) = (value);                                                                         \
        }                                                                                                              \
        break;                                                                                                         \
    }
#define KERNELS_OF(form, value)                                                                                        \
    KERNEL(form, 0, OF_ONE, OF_ONE, value)                                                                             \
    KERNEL(form, 1, OF_PLACE, OF_ONE, value)                                                                           \
    KERNEL(form, 2, OF_SLOT, OF_ONE, value)                                                                            \
    KERNEL(form, 3, OF_ONE, OF_PLACE, value)                                                                           \
    KERNEL(form, 4, OF_PLACE, OF_PLACE, value)                                                                         \
    KERNEL(form, 5, OF_SLOT, OF_PLACE, value)                                                                          \
    KERNEL(form, 6, OF_ONE, OF_SLOT, value)                                                                            \
    KERNEL(form, 7, OF_PLACE, OF_SLOT, value)                                                                          \
    KERNEL(form, 8, OF_SLOT, OF_SLOT, value)

enum { KERNELS = 9, SUM = 0, LESS_X, LESS_Y, NEGATIVE_SUM, PRODUCT, NEGATIVE_PRODUCT, FORMS, NOTHING = -1, CODE = -2 };

static int kind_of(const kmp_scan_row *row)
{
    return row->by_slot ? 2 : row->by_place ? 1 : 0;
}

/* The number of the kernel of a step; KERNELS * FORMS and the operation for others. */
static int kernel_of(const step *s)
{
    int kinds = kind_of(&s->x) + 3 * kind_of(&s->y), negative = (s->x.sign < 0) + 2 * (s->y.sign < 0);
    if (s->op == KMP_OP_ADD)
        return KERNELS * (SUM + negative) + kinds;
    if (s->op == KMP_OP_MUL)
        return KERNELS * (negative == 0 || negative == 3 ? PRODUCT : NEGATIVE_PRODUCT) + kinds;
    return KERNELS * FORMS + s->op;
}

static KMP_INTO_CLONES void divide(const step *s, const groups *n)
{
    const double sign = s->x.sign * s->y.sign;
    ALONG(s, n, sign * x / y)
}

static KMP_INTO_CLONES void larger(const step *s, const groups *n)
{
    const double sx = s->x.sign, sy = s->y.sign;
    ALONG_FOURS(s, n, KMP_FOUR_SELECT((sx * x > sy * y) | (x != x), sx * x, sy * y))
}

static KMP_INTO_CLONES void less(const step *s, const groups *n)
{
    const double sx = s->x.sign, sy = s->y.sign;
    ALONG_FOURS(s, n, KMP_FOUR_SELECT(sx * x < sy * y, KMP_FOUR_ALL(1.0), (kmp_four){0}))
}

static KMP_INTO_CLONES void choose(const step *s, const groups *n)
{
    const double sy = s->y.sign, sz = s->z.sign;
    ALONG_FOURS(s, n, KMP_FOUR_SELECT(x != 0, sy * y, sz * z))
}

/* Operands that depend on arguments are in slots, one after another. */
static KMP_INTO_CLONES void root(const step *s, const groups *n)
{
    if (s->x.by_slot) {
        const double *x = s->x.row + n->slot, sign = s->x.sign;
        double *restrict to = s->to + n->slot;
        const size_t count = n->count * LANES;
        for (size_t k = 0; k < count; k++)
            to[k] = sqrt(sign * x[k]);
        return;
    }
    EACH(s, n)
    for (size_t l = 0; l < LANES; l++)
        to[l] = sqrt(rows[0].sign * kmp_scan_at(&rows[0], first[group], slot)[l]);
}

static double value_at(const kmp_scan_row *row, size_t place, size_t slot, size_t l)
{
    return row->sign * kmp_scan_at(row, place, slot)[l];
}

static void other(const kmp_program *p, const step *s, const groups *n)
{
    EACH(s, n)
    for (size_t l = 0; l < LANES; l++)
        to[l] = kmp_program_value(p, s->instruction, value_at(&rows[0], first[group], slot, l),
                                  value_at(&rows[1], first[group], slot, l), value_at(&rows[2], first[group], slot, l));
}

static void look_up_at(const step *s, int order, size_t count, const double *x, size_t slot)
{
    if (s->finds)
        kmp_table_find(s->table, (int)count, s->x.sign, x, s->piece + slot);
    if (s->slope)
        kmp_table_both(s->table, (int)count, s->x.sign, x, s->piece + slot, s->to + slot, s->slope + slot);
    else
        kmp_table_values(s->table, order, (int)count, s->x.sign, x, s->piece + slot, s->to + slot);
}

/* Operands in slots are one after another. */
static void look_up(const step *s, int order, const groups *n)
{
    if (s->x.by_slot) {
        look_up_at(s, order, n->count * LANES, s->x.row + n->slot, n->slot);
        return;
    }
    for (size_t group = 0, slot = n->slot; group < n->count; group++, slot += LANES)
        look_up_at(s, order, LANES, kmp_scan_at(&s->x, n->first[group], slot), slot);
}

/* Machine code of several instructions. */
static KMP_INTO_CLONES void run_code(const step *s, const groups *n)
{
    kmp_row_routine *const run = s->routine;
    for (size_t group = 0, slot = n->slot; group < n->count; group++, slot += LANES)
        for (size_t lane = 0; lane < LANES; lane += s->lanes)
            run(s->to + slot + lane, s->x.row + n->first[group] + lane, s->y.row + lane);
}

KMP_CLONES static void run_steps(const kmp_program *p, const step *s, const step *end, const groups *n)
{
    for (; s < end; s++)
        switch (s->kernel) {
            KERNELS_OF(SUM, x + y)
            KERNELS_OF(LESS_X, y - x)
            KERNELS_OF(LESS_Y, x - y)
            KERNELS_OF(NEGATIVE_SUM, -x - y)
            KERNELS_OF(PRODUCT, (x * y))
            KERNELS_OF(NEGATIVE_PRODUCT, -(x * y))
        case KERNELS *FORMS + KMP_OP_DIV:
            divide(s, n);
            break;
        case KERNELS *FORMS + KMP_OP_SQRT:
            root(s, n);
            break;
        case KERNELS *FORMS + KMP_OP_MAX:
            larger(s, n);
            break;
        case KERNELS *FORMS + KMP_OP_LESS:
            less(s, n);
            break;
        case KERNELS *FORMS + KMP_OP_SELECT:
            choose(s, n);
            break;
        case KERNELS *FORMS + KMP_OP_TABLE:
            look_up(s, (int)p->instruction[s->instruction].c, n);
            break;
        case NOTHING:
            break;
        case CODE:
            run_code(s, n);
            break;
        default:
            other(p, s, n);
            break;
        }
}

/* -- construction ------------------------------------------------------------------------------------ */

/* Numbers suit both kinds. Common values are in stage 0, except in programs from files. */
static need need_of_instruction(const kmp_scan *s, int i)
{
    const kmp_instruction *in = &s->p->instruction[i];
    need n = STANDING;
    bool first = true;
    for (int k = 0; k < kmp_op_arity((kmp_op)in->op); k++) {
        uint32_t operand = kmp_instruction_operand(in, k);
        if ((int)(operand >> 1) < s->p->constant_count)
            continue;
        const need own = (need)s->need[operand >> 1];
        n = first || n == own ? own : MOVING; /* also of a common and a standing one */
        first = false;
    }
    return n == COMMON ? MOVING : n;
}

/* True for values whose row another value has after their last use. Rows of tables are written next to other steps. */
static bool leaves_row(const kmp_scan *s, uint32_t value)
{
    const int i = (int)value - leaves(s->p);
    return i >= s->p->code[FIRST] && s->need[value] == MOVING && s->p->instruction[i].op != KMP_OP_TABLE;
}

/* Rows of values that depend on arguments and places: as few as are needed at once, so that they stay in the nearest
 * cache. Returns their number. */
static int32_t share_rows(kmp_scan *s, int *last, int32_t *unused)
{
    const kmp_program *p = s->p;
    int count = 0;
    int32_t rows = 0;
    for (int i = p->code[FIRST]; i < p->code[LAST + 1]; i++) {
        const uint32_t value = (uint32_t)(leaves(p) + i);
        if (leaves_row(s, value))
            s->address[value].at = count > 0 ? unused[--count] : rows++;
        for (int k = 0; k < kmp_op_arity((kmp_op)p->instruction[i].op); k++) {
            const uint32_t operand = kmp_instruction_operand(&p->instruction[i], k) >> 1;
            if (!leaves_row(s, operand) || last[operand] != i)
                continue;
            unused[count++] = s->address[operand].at;
            last[operand] = -1; /* another operand may be the same */
        }
    }
    return rows;
}

/* Rows of all values, the rows of a base one after another, and of the merits. False: no memory. */
static bool place_rows(kmp_scan *s)
{
    const int values = leaves(s->p) + s->p->code[LAST + 1];
    int32_t rows[KMP_ROW_BASES] = {0};
    kmp_arena room = {0};
    int *last = KMP_ARENA_NEW(&room, int, values);
    int32_t *unused = KMP_ARENA_NEW(&room, int32_t, values);
    s->merit = KMP_ARENA_NEW(&s->arena, double, s->width);
    if (!room.failed) {
        /* By value: the last instruction that reads it, or its own; the values that stay after all, too. */
        const kmp_program *p = s->p;
        const int code = p->code[LAST + 1];
        for (int value = 0; value < leaves(p) + code; value++)
            last[value] = value - leaves(p);
        for (int i = p->code[FIRST]; i < code; i++)
            for (int k = 0; k < kmp_op_arity((kmp_op)p->instruction[i].op); k++)
                last[kmp_instruction_operand(&p->instruction[i], k) >> 1] = i;
        for (int k = p->outputs[FIRST]; k < p->outputs[LAST + 1]; k++)
            last[p->output[k] >> 1] = code;
        rows[KMP_ROW_BY_SLOT] = share_rows(s, last, unused);
        for (uint32_t k = 0; k < (uint32_t)values; k++) {
            s->address[k].base = is_short(s, k)         ? KMP_ROW_EQUAL
                                 : s->need[k] == MOVING ? KMP_ROW_BY_SLOT
                                                        : KMP_ROW_BY_PLACE;
            if (!leaves_row(s, k))
                s->address[k].at = rows[s->address[k].base]++;
        }
    }
    for (int k = 0; k < KMP_ROW_BASES; k++)
        s->base[k] = kmp_arena_aligned(&s->arena, (size_t)rows[k] * (k == KMP_ROW_EQUAL ? LANES : s->width));
    const bool made = !room.failed && !s->arena.failed;
    for (int k = 0; made && k < values; k++) {
        kmp_row_address *of = &s->address[k];
        of->at *= of->base == KMP_ROW_EQUAL ? LANES : (int32_t)s->width;
        s->row[k] = s->base[of->base] + of->at;
    }
    kmp_arena_free(&room);
    return made;
}

static void fill_lanes(double *to, size_t width, double value)
{
    for (size_t l = 0; l < width; l++)
        to[l] = value;
}

static step step_of(const kmp_scan *s, int i)
{
    const kmp_instruction *in = &s->p->instruction[i];
    int arity = kmp_op_arity((kmp_op)in->op);
    step made = {.op = in->op, .instruction = i, .to = s->row[leaves(s->p) + i]};
    made.x = row_of(s, in->a);
    made.y = arity > 1 ? row_of(s, in->b) : made.x;
    made.z = arity > 2 ? row_of(s, in->c) : made.x;
    made.kernel = kernel_of(&made);
    return made;
}

/* Lets a step that looks up a table use the pieces that an earlier step found, or its own. A slope comes with the value
 * that was looked up there. */
static void share_pieces(kmp_scan *s, step *made, int tables)
{
    const kmp_instruction *in = s->p->instruction, *here = &in[made->instruction];
    made->table = s->p->table[here->b];
    made->finds = true;
    made->piece = s->pieces + (size_t)tables * s->width;
    for (step *before = s->steps; before < made; before++)
        if (before->finds && in[before->instruction].a == here->a && in[before->instruction].b == here->b) {
            made->finds = false;
            made->piece = before->piece;
            if (in[before->instruction].c == 0 && here->c == 1) {
                before->slope = made->to;
                made->kernel = NOTHING;
            }
        }
}

static void list_steps(kmp_scan *s)
{
    const kmp_program *p = s->p;
    const kmp_row_piece *piece = s->code && s->code->count > 0 ? s->code->piece : NULL; /* the next one */
    int count = 0, tables = 0;
    for (int stage = FIRST; stage <= LAST; stage++) {
        s->step_start[stage] = count;
        for (int i = p->code[stage]; i < p->code[stage + 1]; i++) {
            if (s->need[leaves(p) + i] != MOVING)
                continue;
            kmp_counts_take(&s->once[stage], &p->instruction[i], 1);
            while (piece && piece->end <= i)
                piece = piece + 1 < s->code->piece + s->code->count ? piece + 1 : NULL;
            if (piece && i > piece->first)
                continue;
            if (piece && i == piece->first) {
                s->steps[count++] = (step){.kernel = CODE,
                                           .instruction = piece->first,
                                           .to = s->base[KMP_ROW_BY_SLOT],
                                           .x = {.row = s->base[KMP_ROW_BY_PLACE]},
                                           .y = {.row = s->base[KMP_ROW_EQUAL]},
                                           .routine = piece->run,
                                           .lanes = (size_t)s->code->lanes};
                continue;
            }
            s->steps[count] = step_of(s, i);
            if (p->instruction[i].op == KMP_OP_TABLE)
                share_pieces(s, &s->steps[count], tables++);
            count++;
        }
    }
    s->step_start[LAST + 1] = count;
}

static bool allocate(kmp_scan *s)
{
    const kmp_program *p = s->p;
    int code = p->code[LAST + 1], values = leaves(p) + code, tables = 0;
    for (int i = p->code[FIRST]; i < code; i++)
        tables += p->instruction[i].op == KMP_OP_TABLE;
    KMP_ARENA_MAKE(&s->arena, KMP_ROOM(double *, values, &s->row), KMP_ROOM(uint8_t, 2 * values, &s->need),
                   KMP_ROOM(int, values, &s->common), KMP_ROOM(step, code, &s->steps),
                   KMP_ROOM(kmp_row_address, values, &s->address), KMP_ROOM(int, (size_t)tables * s->width, &s->pieces),
                   KMP_ROOM(size_t, s->width / LANES, &s->every));
    s->first = kmp_interpreter_new(p);
    return s->first && !s->arena.failed;
}

static bool init(kmp_scan *s, int places, const double *place, bool native)
{
    if (!allocate(s))
        return false;
    for (size_t k = 0; k < s->width / LANES; k++)
        s->every[k] = k * LANES;
    /* Needs of all values: numbers, inputs, instructions. */
    const kmp_program *p = s->p;
    for (int k = 0; k < p->constant_count; k++)
        s->need[k] = STANDING;
    for (int k = 0; k < p->input_count; k++)
        s->need[p->constant_count + k] = (uint8_t)(p->input[k].kind == KMP_IN_PARAMETER ? COMMON
                                                   : p->input[k].index == 0             ? STANDING
                                                                                        : MOVING);
    for (int i = 0; i < p->code[LAST + 1]; i++)
        s->need[leaves(p) + i] = (uint8_t)(i < p->code[FIRST] ? COMMON : need_of_instruction(s, i));
    /* Common values that later stages read. */
    uint8_t *seen = s->need + leaves(p) + p->code[LAST + 1]; /* as many as values */
    for (int i = p->code[FIRST]; i < p->code[LAST + 1]; i++)
        for (int k = 0; k < kmp_op_arity((kmp_op)p->instruction[i].op); k++)
            seen[kmp_instruction_operand(&p->instruction[i], k) >> 1] = 1;
    for (int k = p->outputs[FIRST]; k < p->outputs[LAST + 1]; k++)
        seen[p->output[k] >> 1] = 1;
    for (int value = 0; value < leaves(p) + p->code[LAST + 1]; value++)
        if (seen[value] && s->need[value] == COMMON)
            s->common[s->common_count++] = value;
    if (!place_rows(s))
        return false;
    /* Sets numbers and places, and computes the values that depend only on them. */
    const groups all = {s->width / LANES, s->every, 0};
    for (int k = 0; k < p->constant_count; k++)
        fill_lanes(s->row[k], LANES, p->constant[k]);
    for (int k = 0; k < p->input_count; k++)
        if (s->need[p->constant_count + k] == STANDING) {
            fill_lanes(s->row[p->constant_count + k], s->width, place[0]);
            memcpy(s->row[p->constant_count + k], place, (size_t)places * sizeof *place);
        }
    for (int i = p->code[FIRST]; i < p->code[LAST + 1]; i++)
        if (s->need[leaves(p) + i] == STANDING) {
            const step made = step_of(s, i);
            if (p->instruction[i].op == KMP_OP_TABLE)
                other(p, &made, &all);
            else
                run_steps(p, &made, &made + 1, &all);
        }
    s->code = native ? kmp_row_code_of(s->p, s->width, s->address) : NULL;
    list_steps(s);
    return true;
}

kmp_scan *kmp_scan_new(const kmp_program_block *block, int places, const double *place, bool native)
{
    kmp_scan *s = KMP_NEW(kmp_scan, 1);
    if (!s)
        return NULL;
    s->p = block->program;
    s->width = ((size_t)places + LANES - 1) / LANES * LANES;
    if (init(s, places, place, native))
        return s;
    kmp_scan_free(s);
    return NULL;
}

void kmp_scan_free(void *scan)
{
    kmp_scan *s = scan;
    if (!s)
        return;
    kmp_interpreter_free(s->first);
    kmp_arena_free(&s->arena);
    kmp_free(s);
}

/* -- run --------------------------------------------------------------------------------------------- */

void kmp_scan_set(kmp_scan *s, const double *arguments)
{
    s->settings++;
    kmp_interpreter_set(s->first, KMP_IN_PARAMETER, arguments);
    (void)kmp_interpreter_run(s->first, 0);
    const double *values = kmp_interpreter_values(s->first);
    for (int k = 0; k < s->common_count; k++)
        fill_lanes(s->row[s->common[k]], LANES, values[s->common[k]]);
}

void kmp_scan_groups(kmp_scan *s, int stage, size_t count, const size_t *first, size_t slot)
{
    const groups n = {count, first, slot};
    s->runs[stage] += (long)count;
    run_steps(s->p, s->steps + s->step_start[stage], s->steps + s->step_start[stage + 1], &n);
}

kmp_counts kmp_scan_count(const void *scan)
{
    const kmp_scan *s = scan;
    kmp_counts c = {0};
    const kmp_counts common = kmp_program_count(s->p, 0, 0);
    kmp_counts_add(&c, &common, s->settings);
    for (int stage = FIRST; stage <= LAST; stage++)
        kmp_counts_add(&c, &s->once[stage], LANES * s->runs[stage]);
    return c;
}

kmp_scan_row kmp_scan_output(const kmp_scan *s, int stage, int k)
{
    return row_of(s, s->p->output[s->p->outputs[stage] + k]);
}

/* A whole row with its signs. */
static void copy_row(const kmp_scan *s, const kmp_scan_row *from, double *to)
{
    for (size_t k = 0; k < s->width; k++)
        to[k] = value_at(from, k / LANES * LANES, k / LANES * LANES, k % LANES);
}

void *kmp_scan_of_candidates(const kmp_program_block *block, bool native)
{
    return kmp_scan_new(block, block->candidates, block->candidate, native);
}

const double *kmp_scan_run(void *scan, const double *arguments)
{
    kmp_scan *s = scan;
    kmp_scan_set(s, arguments);
    kmp_scan_groups(s, FIRST, s->width / LANES, s->every, 0);
    /* Sets the other unknowns to their guesses. */
    const kmp_program *p = s->p;
    for (int k = 0; k < p->input_count; k++)
        if (p->input[k].kind == KMP_IN_Q && p->input[k].index > 0) {
            const kmp_scan_row from = kmp_scan_output(s, FIRST, (int)p->input[k].index);
            copy_row(s, &from, s->row[p->constant_count + k]);
        }
    kmp_scan_groups(s, LAST, s->width / LANES, s->every, 0);
    const kmp_scan_row merit = kmp_scan_output(s, LAST, 0);
    copy_row(s, &merit, s->merit);
    return s->merit;
}
