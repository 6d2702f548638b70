/* SPDX-License-Identifier: BSD-3-Clause */
/* A program's arrays one after another. A table is written where it is first used; later uses have its number. */
#include "symbolic/program_bytes.h"
#include "base/memory.h"
#include "symbolic/contraction.h"
#include "symbolic/implicit.h"
#include "symbolic/table_function.h"
#include <limits.h>

enum { MOST_STAGES = 64, MOST_DEPTH = 8, NO_PROGRAM = 0, PROGRAM = 1 };

/* -- tables ------------------------------------------------------------------------------------------ */

void kmp_table_pool_free(kmp_table_pool *pool)
{
    for (int k = 0; k < pool->count; k++)
        kmp_table_free(pool->table[k]);
    kmp_free(pool->table);
    *pool = (kmp_table_pool){0};
}

/* Takes the table. False: no memory, and the table is freed. */
static bool add_to_pool(kmp_table_pool *pool, kmp_table *table)
{
    kmp_table **grown = kmp_realloc(pool->table, (size_t)pool->count + 1, sizeof(kmp_table *));
    if (!grown) {
        kmp_table_free(table);
        return false;
    }
    pool->table = grown;
    grown[pool->count++] = table;
    return true;
}

static void put_table(kmp_bytes *b, kmp_table_pool *pool, kmp_table *table)
{
    int k = 0;
    while (k < pool->count && pool->table[k] != table)
        k++;
    kmp_bytes_put_int(b, k);
    if (k < pool->count)
        return;
    kmp_bytes_put_int(b, table->method);
    kmp_bytes_put_int(b, table->count);
    KMP_BYTES_PUT(b, table->x, table->count);
    KMP_BYTES_PUT(b, table->y, table->count);
    b->failed = !add_to_pool(pool, kmp_table_share(table)) || b->failed;
}

/* Reads a table that is new to the pool; false: it is none. */
static bool get_new_table(kmp_byte_source *s, kmp_table_pool *pool)
{
    kmp_arena room = {0};
    int method = kmp_bytes_take_int(s, 0, KMP_TABLE_METHODS - 1), count = kmp_bytes_take_count(s, 2 * sizeof(double));
    double *x = KMP_ARENA_NEW(&room, double, count), *y = KMP_ARENA_NEW(&room, double, count);
    kmp_table *table = NULL;
    if (x && y) {
        KMP_BYTES_TAKE(s, x, count);
        KMP_BYTES_TAKE(s, y, count);
        if (!s->failed && kmp_table_check(count, x, y) < 0)
            table = kmp_table_new((kmp_table_method)method, count, x, y);
    }
    kmp_arena_free(&room);
    return table && add_to_pool(pool, table);
}

/* -- instructions ------------------------------------------------------------------------------------ */

/* An instruction as numbers of one size, without a gap between them. `op` has the contraction in its upper half. */
typedef struct words {
    uint32_t op, a, b, c;
} words;

enum { UPPER = 16 };

enum { AT_ONCE = 256 }; /* instructions that are written or read together */

static int part_of(int count, int done)
{
    return count - done < AT_ONCE ? count - done : AT_ONCE;
}

/* -- writing ----------------------------------------------------------------------------------------- */

void kmp_program_put(kmp_bytes *b, kmp_table_pool *pool, const kmp_program *p)
{
    kmp_bytes_put_int(b, p ? PROGRAM : NO_PROGRAM);
    if (!p)
        return;
    int stages = p->stages;
    const int64_t sizes[] = {stages,         p->code[stages], p->outputs[stages], p->constant_count,     p->input_count,
                             p->table_count, p->block_count,  p->graph_nodes,     p->contraction != NULL};
    for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++)
        kmp_bytes_put_int(b, sizes[k]);
    KMP_BYTES_PUT(b, p->code, stages + 1);
    KMP_BYTES_PUT(b, p->outputs, stages + 1);
    KMP_BYTES_PUT(b, p->output, p->outputs[stages]);
    KMP_BYTES_PUT(b, p->constant, p->constant_count);
    KMP_BYTES_PUT(b, p->input, p->input_count);
    int count = p->code[stages];
    const kmp_instruction *in = p->instruction;
    words w[AT_ONCE];
    for (int i = 0; i < count; i += AT_ONCE) {
        int part = part_of(count, i);
        for (int k = 0; k < part; k++) {
            uint32_t with = p->contraction ? p->contraction[i + k] : KMP_ALONE;
            w[k] = (words){in[i + k].op | with << UPPER, in[i + k].a, in[i + k].b, in[i + k].c};
        }
        KMP_BYTES_PUT(b, w, part);
    }
    for (int k = 0; k < p->table_count; k++)
        put_table(b, pool, p->table[k]);
    for (int k = 0; k < p->block_count; k++) {
        const kmp_program_block *block = &p->block[k];
        const int numbers[] = {block->unknowns, block->arguments, block->linear, block->averages, block->candidates};
        KMP_BYTES_PUT(b, numbers, sizeof numbers / sizeof *numbers);
        KMP_BYTES_PUT(b, block->candidate, block->candidates);
        kmp_program_put(b, pool, block->program);
    }
}

/* -- checks ------------------------------------------------------------------------------------------ */

/* True if the stages begin with zero, follow each other, and end at `end`. */
static bool is_partition(const int *first, int stages, int end)
{
    bool good = first[0] == 0 && first[stages] == end;
    for (int s = 0; s < stages; s++)
        good = good && first[s] <= first[s + 1];
    return good;
}

/* True if the operand is a list of as many items as the block has arguments. */
static bool is_list(const kmp_program *p, uint32_t list, int arguments)
{
    uint32_t leaves = (uint32_t)(p->constant_count + p->input_count);
    for (int l = 0; l < arguments; l++) {
        uint32_t value = list >> 1;
        if (list & 1 || value < leaves || p->instruction[value - leaves].op != KMP_OP_LIST)
            return false;
        list = p->instruction[value - leaves].b;
    }
    return true;
}

static bool is_instruction(const kmp_program *p, int i)
{
    const kmp_instruction *in = &p->instruction[i];
    uint32_t values = (uint32_t)(p->constant_count + p->input_count + i);
    int arity = in->op < KMP_OP_COUNT ? kmp_op_arity((kmp_op)in->op) : 0;
    bool good = arity > 0;
    for (int k = 0; good && k < arity; k++)
        good = kmp_instruction_operand(in, k) >> 1 < values;
    if (in->op == KMP_OP_TABLE)
        good = good && in->b < (uint32_t)p->table_count;
    if (in->op == KMP_OP_IMPLICIT)
        good = good && in->b < (uint32_t)p->block_count && in->c < (uint32_t)p->block[in->b].unknowns &&
               is_list(p, in->a, p->block[in->b].arguments);
    return good;
}

/* True if the operand of a sum is a product that the sum takes. */
static bool is_taken(const kmp_program *p, uint32_t operand)
{
    uint32_t leaves = (uint32_t)(p->constant_count + p->input_count), value = operand >> 1;
    return value >= leaves && p->instruction[value - leaves].op == KMP_OP_MUL &&
           p->contraction[value - leaves] == KMP_CONTRACTED;
}

static bool is_contraction(const kmp_program *p, int i)
{
    const kmp_instruction *in = &p->instruction[i];
    switch (p->contraction[i]) {
    case KMP_ALONE:
        return true;
    case KMP_CONTRACTED:
        return in->op == KMP_OP_MUL;
    case KMP_WITH_FIRST:
        return in->op == KMP_OP_ADD && is_taken(p, in->a);
    case KMP_WITH_SECOND:
        return in->op == KMP_OP_ADD && is_taken(p, in->b);
    default:
        return false;
    }
}

static bool is_program(const kmp_program *p)
{
    int code = p->code[p->stages], outputs = p->outputs[p->stages];
    uint32_t values = (uint32_t)(p->constant_count + p->input_count + code);
    bool good = true;
    for (int k = 0; good && k < p->input_count; k++)
        good = (int)p->input[k].kind >= 0 && p->input[k].kind < KMP_IN_COUNT;
    for (int i = 0; good && i < code; i++)
        good = is_instruction(p, i) && (!p->contraction || is_contraction(p, i));
    for (int k = 0; good && k < outputs; k++)
        good = p->output[k] >> 1 < values;
    return good;
}

/* True if a block's program has the outputs that the block needs: guesses of the unknowns, with candidates the merit of
 * a guess, residuals with their derivatives by the unknowns; for averages the exponent and its least value that counts,
 * then the quantities. */
static bool has_outputs(const kmp_program_block *block)
{
    int n = block->unknowns;
    bool among = block->candidates > 0 && !block->averages;
    int first = block->averages ? 2 : n, last = block->averages ? n - 1 : n + n * n + (among && n == 1);
    const kmp_program *p = block->program;
    return p->block_count == 0 && p->stages == 3 + among && p->outputs[1] == 0 && p->outputs[2] == first &&
           (!among || p->outputs[3] == n + 1) && p->outputs[p->stages] == first + among + last;
}

/* True if candidates or places ascend, and the program reads only unknowns q and arguments p. */
static bool is_block(const kmp_program_block *block)
{
    const kmp_program *p = block->program;
    int unknowns = block->averages ? 1 : block->unknowns;
    const bool wide = block->averages || block->candidates > 0;
    bool good = (!wide || kmp_places_of_build()) &&
                (block->averages ? block->candidates > 2 : unknowns <= KMP_IMPLICIT_MOST) && has_outputs(block);
    for (int k = 1; good && k < block->candidates; k++)
        good = block->candidate[k] >= block->candidate[k - 1];
    for (int k = 0; good && k < p->input_count; k++) {
        kmp_input_kind kind = p->input[k].kind;
        int count = kind == KMP_IN_Q ? unknowns : kind == KMP_IN_PARAMETER ? block->arguments : 0;
        good = p->input[k].index < (uint32_t)count;
    }
    return good;
}

/* -- reading ----------------------------------------------------------------------------------------- */

static kmp_program *get_program(kmp_byte_source *s, kmp_table_pool *pool, int depth);

static bool get_block(kmp_byte_source *s, kmp_table_pool *pool, int depth, kmp_program *p)
{
    int numbers[5];
    kmp_arena room = {0};
    KMP_BYTES_TAKE(s, numbers, 5);
    kmp_program_block block = {.unknowns = numbers[0],
                               .arguments = numbers[1],
                               .linear = numbers[2],
                               .averages = numbers[3],
                               .candidates = numbers[4]};
    const size_t bytes = (size_t)(s->end - s->at);
    bool good = !s->failed && block.unknowns > 0 && (size_t)block.unknowns <= bytes && block.arguments >= 0 &&
                block.candidates >= 0 && (size_t)block.candidates <= bytes / sizeof(double);
    block.candidate = good ? KMP_ARENA_NEW(&room, double, block.candidates) : NULL;
    if (block.candidate) {
        KMP_BYTES_TAKE(s, block.candidate, block.candidates);
        block.program = kmp_bytes_take_int(s, PROGRAM, PROGRAM) == PROGRAM ? get_program(s, pool, depth + 1) : NULL;
        good = block.program && is_block(&block) && kmp_program_add_block(p, &block) >= 0;
        kmp_program_free(block.program);
    } else {
        good = false;
    }
    kmp_arena_free(&room);
    return good;
}

static bool read_program_body(kmp_byte_source *s, kmp_table_pool *pool, int depth, const int *size, kmp_program *p)
{
    p->stages = size[0];
    p->constant_count = size[3];
    p->input_count = size[4];
    KMP_BYTES_TAKE(s, p->code, p->stages + 1);
    KMP_BYTES_TAKE(s, p->outputs, p->stages + 1);
    KMP_BYTES_TAKE(s, p->output, size[2]);
    KMP_BYTES_TAKE(s, p->constant, p->constant_count);
    KMP_BYTES_TAKE(s, p->input, p->input_count);
    int count = size[1];
    enum { LOWER = (1 << UPPER) - 1 };
    words w[AT_ONCE];
    uint32_t most = 0, with = KMP_ALONE;
    for (int i = 0; i < count; i += AT_ONCE) {
        int part = part_of(count, i);
        KMP_BYTES_TAKE(s, w, part);
        for (int k = 0; k < part; k++) {
            uint32_t op = w[k].op & LOWER;
            most = op > most ? op : most;
            p->instruction[i + k] = (kmp_instruction){(uint8_t)op, w[k].a, w[k].b, w[k].c};
            with |= w[k].op >> UPPER;
            if (p->contraction)
                p->contraction[i + k] = (uint8_t)(w[k].op >> UPPER);
        }
    }
    s->failed = s->failed || most >= KMP_OP_COUNT || (with != KMP_ALONE && !p->contraction);
    if (s->failed || !is_partition(p->code, p->stages, size[1]) || !is_partition(p->outputs, p->stages, size[2]))
        return false;
    bool good = true;
    for (int k = 0; good && k < size[5]; k++) {
        const int table = kmp_bytes_take_int(s, 0, pool->count);
        good = !s->failed && (table < pool->count || get_new_table(s, pool)) &&
               kmp_program_add_table(p, pool->table[table]) >= 0;
    }
    for (int k = 0; good && k < size[6]; k++)
        good = get_block(s, pool, depth, p);
    return good && p->table_count == size[5] && is_program(p);
}

static kmp_program *get_program(kmp_byte_source *s, kmp_table_pool *pool, int depth)
{
    static const size_t each[] = {0, sizeof(words), sizeof(uint32_t), sizeof(double), sizeof(kmp_program_input), 1, 1};
    enum { SIZES = sizeof each / sizeof *each };
    int size[SIZES];
    size[0] = kmp_bytes_take_int(s, 1, MOST_STAGES);
    for (size_t k = 1; k < SIZES; k++)
        size[k] = kmp_bytes_take_count(s, each[k]);
    uint32_t nodes = (uint32_t)kmp_bytes_take_int(s, 0, INT_MAX);
    bool contracts = kmp_bytes_take_int(s, false, true);
    kmp_program *p = s->failed || depth > MOST_DEPTH
                         ? NULL
                         : kmp_program_with_room((size_t)size[0], (size_t)size[1], (size_t)size[2], (size_t)size[3],
                                                 (size_t)size[4]);
    if (p && contracts)
        p->contraction = KMP_ARENA_NEW(&p->arena, uint8_t, size[1]);
    if (p && !p->arena.failed && read_program_body(s, pool, depth, size, p)) {
        p->graph_nodes = nodes;
        return p;
    }
    kmp_program_free(p);
    s->failed = true;
    return NULL;
}

kmp_program *kmp_program_get(kmp_byte_source *s, kmp_table_pool *pool)
{
    return kmp_bytes_take_int(s, NO_PROGRAM, PROGRAM) == PROGRAM ? get_program(s, pool, 0) : NULL;
}
