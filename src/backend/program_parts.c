/* SPDX-License-Identifier: BSD-3-Clause */
/* Parts of a stage that do not read each other: the sub-systems of a vehicle, as far as its equations fall apart.
 *
 * Implicit blocks are the seeds: blocks that share most of their inputs' computation go together. Values that several
 * parts read come before all of them, values that read several parts come after. The instructions and their bits are
 * unchanged.
 *
 * A heuristic partition: implicit blocks are merged greedily by the cost of the instructions that feed both, other
 * instructions follow their readers or operands. The number of parts with the shortest estimated duration wins. */
#include "backend/program_parts.h"
#include "backend/layout.h"
#include "base/thread_pool.h"
#include "base/union_find.h"
#include <string.h>

/* Times in nanoseconds, roughly: of a stage that is worth dividing; of a call. */
enum { LEAST = 10000, CALL = 2000 };
enum { SOLVING = 1500 }; /* time of a block in nanoseconds: 0.7 us near the last solution, up to 4 us farther away */
/* Work in parallel with a stage that is expected, relative to the stage: on the tram the reduced mass matrix takes 0.15
 * of C. It follows from earlier stages, which the first one has not. */
static const double BESIDE = 0.15;
enum { FIRST_STAGE = 1 }; /* after the stage of constants */
enum { SEEDS = 64, BEFORE = 0, FREE = 255 };

typedef uint64_t seeds; /* a set of seeds */

typedef struct finder {
    const kmp_layout *l;
    kmp_arena *arena; /* of the layout */
    int from, count;  /* instructions of the stage */
    int seed_count;
    seeds *reads, *feeds; /* by instruction of the stage */
    seeds *earlier;       /* by instruction of the stages before: the seeds that it feeds here */
    double share[SEEDS][SEEDS];
    int up[SEEDS], part_of[SEEDS]; /* union-find of the seeds in one part; the part of each seed */
    int parts;
    uint8_t *part, *best; /* by instruction of the stage */
    uint8_t *wish;
    int *root; /* of each connected set that touches no block */
    double *weight;
    double *price; /* nanoseconds, by instruction of the stage */
    double cost[KMP_PARTS_MOST + 2];
    double alone, beside; /* cost of the stage in one part, and of work in parallel with it */
} finder;

static const kmp_instruction *instruction(const finder *f, int i)
{
    return &f->l->program->instruction[f->from + i];
}

static int operands(const finder *f, int i)
{
    return kmp_op_arity((kmp_op)instruction(f, i)->op);
}

/* Operand k as its index in the stage; -1: it is computed outside the stage. */
static int operand(const finder *f, int i, int k)
{
    int j = kmp_layout_instruction(f->l, kmp_instruction_operand(instruction(f, i), k)) - f->from;
    return j >= 0 ? j : -1;
}

static double price_of(kmp_op op)
{
    switch (op) {
    case KMP_OP_ADD:
    case KMP_OP_MUL:
    case KMP_OP_IMPLICIT:
        return 1;
    case KMP_OP_DIV:
    case KMP_OP_SQRT:
        return 5;
    default:
        return 15;
    }
}

/* True if the unknowns of this block with these arguments are solved for here. All of them are solved where the first
 * one is read, in this stage or before. `first`: places of those found so far. */
static bool is_solved(const kmp_instruction *all, int i, int *first, int *count)
{
    for (int b = 0; b < *count; b++)
        if (all[first[b]].a == all[i].a && all[first[b]].b == all[i].b)
            return true;
    first[(*count)++] = i;
    return false;
}

static bool find_prices(finder *f)
{
    const kmp_instruction *all = f->l->program->instruction;
    int end = f->from + f->count, most = 0, count = 0;
    for (int i = 0; i < end; i++)
        most += all[i].op == KMP_OP_IMPLICIT;
    int *first = KMP_ARENA_NEW(f->arena, int, most);
    f->price = KMP_ARENA_NEW(f->arena, double, f->count);
    for (int i = 0; !f->arena->failed && i < end; i++) {
        bool solves = all[i].op == KMP_OP_IMPLICIT && !is_solved(all, i, first, &count);
        if (i >= f->from)
            f->price[i - f->from] = solves ? SOLVING : price_of((kmp_op)all[i].op);
    }
    return !f->arena->failed;
}

/* -- seeds ------------------------------------------------------------------------------------------- */

/* Numbers the seeds in their order; blocks with one list of arguments are one seed. Beyond the limit neighbours share a
 * seed. */
static bool number_seeds(finder *f)
{
    uint32_t *list = KMP_ARENA_NEW(f->arena, uint32_t, f->count);
    int count = 0;
    for (int i = 0; list && i < f->count; i++) {
        int b = 0;
        if (instruction(f, i)->op != KMP_OP_IMPLICIT)
            continue;
        while (b < count && list[b] != instruction(f, i)->a)
            b++;
        if (b == count)
            list[count++] = instruction(f, i)->a;
        f->root[i] = b;
    }
    f->seed_count = count < SEEDS ? count : SEEDS;
    for (int i = 0; list && i < f->count; i++)
        if (instruction(f, i)->op == KMP_OP_IMPLICIT)
            f->reads[i] = f->feeds[i] = (seeds)1 << (count > SEEDS ? (long)f->root[i] * SEEDS / count : f->root[i]);
    return list;
}

static void spread_seeds(finder *f)
{
    for (int i = 0; i < f->count; i++)
        for (int k = 0; k < operands(f, i); k++)
            if (operand(f, i, k) >= 0)
                f->reads[i] |= f->reads[operand(f, i, k)];
    for (int i = f->count; i-- > 0;)
        for (int k = 0; k < operands(f, i); k++) {
            int j = kmp_layout_instruction(f->l, kmp_instruction_operand(instruction(f, i), k));
            if (j >= f->from)
                f->feeds[j - f->from] |= f->feeds[i];
            else if (j >= 0)
                f->earlier[j] |= f->feeds[i];
        }
}

/* The least member of a set that is not empty. */
static int first_of(seeds s)
{
    return __builtin_ctzll(s);
}

/* Adds an instruction's cost to the affinity of the seeds that share it. Instructions of few seeds count more than
 * instructions of many. */
static void add_share(finder *f, seeds s, double cost)
{
    int member[SEEDS], size = 0;
    for (; s; s &= s - 1)
        member[size++] = first_of(s);
    double share = size > 1 ? cost / size / size : 0;
    for (int a = 0; a < size; a++)
        for (int b = a + 1; b < size; b++)
            f->share[member[a]][member[b]] += share;
}

/* The two groups that share most, for their size. */
static bool join_nearest(finder *f)
{
    static const double NONE = -1;
    int size[SEEDS] = {0}, x = 0, y = 0;
    double sum[SEEDS][SEEDS], most = NONE;
    memset(sum, 0, sizeof sum);
    for (int a = 0; a < f->seed_count; a++) {
        size[kmp_root_of(f->up, a)]++;
        for (int b = 0; b < f->seed_count; b++)
            sum[kmp_root_of(f->up, a)][kmp_root_of(f->up, b)] += f->share[a][b];
    }
    for (int a = 0; a < f->seed_count; a++)
        for (int b = 0; b < a; b++)
            if (size[a] > 0 && size[b] > 0 && sum[a][b] / (size[a] * size[b]) > most) {
                most = sum[a][b] / (size[a] * size[b]);
                x = a;
                y = b;
            }
    f->up[x] = y;
    return most > NONE;
}

static void join_seeds(finder *f, int parts)
{
    int groups = 0;
    /* Blocks of which one reads another. */
    for (int k = 0; k < f->seed_count; k++)
        f->up[k] = k;
    for (int i = 0; i < f->count; i++)
        if (f->reads[i] && f->feeds[i])
            for (seeds s = f->reads[i] | f->feeds[i], a = s; a; a &= a - 1)
                f->up[kmp_root_of(f->up, first_of(a))] = kmp_root_of(f->up, first_of(s));
    for (int k = 0; k < f->seed_count; k++)
        groups += kmp_root_of(f->up, k) == k;
    while (groups > parts && join_nearest(f))
        groups--;
    f->parts = f->seed_count > 0 ? 0 : parts;
    for (int k = 0; k < f->seed_count; k++)
        if (kmp_root_of(f->up, k) == k)
            f->part_of[k] = ++f->parts;
    for (int k = 0; k < f->seed_count; k++)
        f->part_of[k] = f->part_of[kmp_root_of(f->up, k)];
}

/* -- parts ------------------------------------------------------------------------------------------- */

/* Places instructions by the blocks that they feed or read. */
static void place_by_seeds(finder *f)
{
    seeds of[KMP_PARTS_MOST + 2] = {0}; /* each part's */
    for (int k = 0; k < f->seed_count; k++)
        of[f->part_of[k]] |= (seeds)1 << k;
    for (int i = 0; i < f->count; i++) {
        seeds s = f->reads[i] | f->feeds[i];
        int part = s ? f->part_of[first_of(s)] : FREE;
        bool several = s && (s & ~of[part]);
        f->part[i] = (uint8_t)(!several ? part : f->reads[i] ? f->parts + 1 : BEFORE);
    }
}

/* Gives a free instruction to the only part that reads it, or puts it before all parts. */
static void place_by_readers(finder *f)
{
    memset(f->wish, FREE, (size_t)f->count);
    for (int i = f->count; i-- > 0;) {
        if (f->part[i] == FREE)
            f->part[i] = f->wish[i];
        if (f->part[i] == FREE || f->part[i] > f->parts)
            continue;
        for (int k = 0; k < operands(f, i); k++) {
            int j = operand(f, i, k);
            if (j >= 0)
                f->wish[j] = f->wish[j] == FREE || f->wish[j] == f->part[i] ? f->part[i] : BEFORE;
        }
    }
}

/* Gives a free instruction to the only part whose values it reads, or puts it after all parts. */
static void place_by_operands(finder *f)
{
    for (int i = 0; i < f->count; i++)
        for (int k = 0; k < operands(f, i); k++) {
            int j = operand(f, i, k), of = j >= 0 ? f->part[j] : FREE;
            if (j < 0 || of == BEFORE || of == FREE || (f->part[i] != FREE && (f->reads[i] | f->feeds[i])))
                continue;
            if (f->part[i] == FREE || f->part[i] == of)
                f->part[i] = (uint8_t)of;
            else if (f->part[i] != BEFORE)
                f->part[i] = (uint8_t)(f->parts + 1);
        }
}

/* Distributes connected sets that touch no block: each goes to the part with the least work. */
static void place_the_rest(finder *f)
{
    for (int i = 0; i < f->count; i++) {
        f->root[i] = i;
        f->weight[i] = 0;
    }
    for (int i = 0; i < f->count; i++)
        for (int k = 0; k < operands(f, i) && f->part[i] == FREE; k++) {
            int j = operand(f, i, k);
            if (j >= 0 && f->part[j] == FREE)
                f->root[kmp_root_of(f->root, i)] = kmp_root_of(f->root, j);
        }
    memset(f->cost, 0, sizeof f->cost);
    for (int i = 0; i < f->count; i++) {
        if (f->part[i] == FREE)
            f->weight[kmp_root_of(f->root, i)] += f->price[i];
        else
            f->cost[f->part[i]] += f->price[i];
    }
    for (int i = 0; i < f->count; i++)
        if (f->part[i] == FREE && f->root[i] == i) {
            int part = 1;
            for (int k = 2; k <= f->parts; k++)
                part = f->cost[k] < f->cost[part] ? k : part;
            f->wish[i] = (uint8_t)part;
            f->cost[f->wish[i]] += f->weight[i];
        }
    for (int i = 0; i < f->count; i++)
        if (f->part[i] == FREE)
            f->part[i] = f->wish[kmp_root_of(f->root, i)];
}

/* The duration of the stage: each thread takes the costliest part that is left. One of them first does a piece in
 * parallel with the stage (kmp_team_bring). */
static double duration(const finder *f, int threads)
{
    double load[KMP_TEAM_MOST] = {f->beside}, cost[KMP_PARTS_MOST + 2], most = 0;
    memcpy(cost, f->cost, sizeof cost);
    for (int part = 0; part < f->parts; part++) {
        int next = 1, thread = 0;
        for (int k = 2; k <= f->parts; k++)
            next = cost[k] > cost[next] ? k : next;
        for (int k = 1; k < threads; k++)
            thread = load[k] < load[thread] ? k : thread;
        load[thread] += cost[next];
        cost[next] = -1;
    }
    for (int k = 0; k < threads; k++)
        most = load[k] > most ? load[k] : most;
    return f->cost[BEFORE] + f->cost[f->parts + 1] + most + CALL;
}

static double try_parts(finder *f, int parts, int threads)
{
    join_seeds(f, parts);
    place_by_seeds(f);
    place_by_readers(f);
    place_by_operands(f);
    place_by_readers(f);
    place_the_rest(f);
    /* Corrects the assignment: an instruction that reads another part comes after all parts. Then computes the
     * costs. */
    memset(f->cost, 0, sizeof f->cost);
    for (int i = 0; i < f->count; i++) {
        for (int k = 0; k < operands(f, i); k++) {
            int j = operand(f, i, k);
            if (j >= 0 && f->part[j] != BEFORE && f->part[j] != f->part[i])
                f->part[i] = (uint8_t)(f->parts + 1);
        }
        f->cost[f->part[i]] += f->price[i];
    }
    return duration(f, threads);
}

/* Numbers the best parts by descending cost: a costly part that begins last would delay all. */
static void put_costliest_first(finder *f, int parts)
{
    double cost[KMP_PARTS_MOST + 2] = {0};
    int number[KMP_PARTS_MOST + 2] = {0};
    for (int i = 0; i < f->count; i++)
        cost[f->best[i]] += f->price[i];
    number[parts + 1] = parts + 1;
    for (int k = 1; k <= parts; k++) {
        number[k] = 1;
        for (int other = 1; other <= parts; other++)
            number[k] += cost[other] > cost[k] || (cost[other] == cost[k] && other < k);
    }
    for (int i = 0; i < f->count; i++)
        f->best[i] = (uint8_t)number[f->best[i]];
}

/* Tries as many parts as threads, or some times as many for parts of unequal size. */
static int choose_parts(finder *f, int threads)
{
    int best = 0;
    double least = (f->alone + f->beside) / 1.2;
    for (int parts = threads; parts <= 4 * threads && parts <= KMP_PARTS_MOST; parts += threads) {
        double time = try_parts(f, parts, threads);
        if (time < 0.95 * least && f->parts > 1) {
            least = time;
            best = f->parts;
            memcpy(f->best, f->part, (size_t)f->count);
        }
    }
    return best;
}

int kmp_parts_find(kmp_layout *layout, int stage, int threads)
{
    const int *code = layout->program->code;
    finder *f = KMP_ARENA_NEW(&layout->arena, finder, 1);
    if (!f)
        return -1;
    f->l = layout;
    f->arena = &layout->arena;
    f->from = code[stage];
    f->count = code[stage + 1] - code[stage];
    if (!find_prices(f))
        return -1;
    for (int i = 0; i < f->count; i++)
        f->alone += f->price[i];
    f->beside = stage > FIRST_STAGE ? BESIDE * f->alone : 0;
    if (f->alone < LEAST)
        return 0;
    KMP_ARENA_MAKE(f->arena, KMP_ROOM(seeds, f->count, &f->reads, &f->feeds), KMP_ROOM(seeds, f->from, &f->earlier),
                   KMP_ROOM(uint8_t, f->count, &f->part, &f->best, &f->wish), KMP_ROOM(int, f->count, &f->root),
                   KMP_ROOM(double, f->count, &f->weight));
    if (f->arena->failed || !number_seeds(f))
        return -1;
    spread_seeds(f);
    /* The cost of each part, and of what two seeds share. */
    for (int i = 0; i < f->from; i++)
        add_share(f, f->earlier[i], 1);
    for (int i = 0; i < f->count; i++)
        add_share(f, f->feeds[i] | f->reads[i], (f->feeds[i] ? 1 : 0.05) * f->price[i]);
    for (int a = 0; a < f->seed_count; a++)
        for (int b = 0; b < a; b++)
            f->share[a][b] = f->share[b][a];
    int parts = choose_parts(f, threads);
    if (parts > 0) {
        put_costliest_first(f, parts);
        memcpy(layout->part + f->from, f->best, (size_t)f->count);
    }
    return parts;
}
