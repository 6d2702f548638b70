/* SPDX-License-Identifier: BSD-3-Clause */
/* Machine code with operations in pairs against the same operations in C, to the bit: random expressions that occur
 * again on other leaves, with sums for differences and operands exchanged, that share values, and that are summed. */
#include "backend/encoder/packs.h"
#include "backend/encoders.h"
#include "base/clones.h"
#include "platform/platform.h"
#include "random.h"
#include "testing.h"
#include <math.h>
#include <string.h>

enum { CONSTANTS = 10, LEAVES = 60, COPIES = 5, SIZE = 400, MOST = COPIES * SIZE + 100, SLOTS = LEAVES + MOST };
enum { ROOM = 4 * SLOTS + KMP_PLACES };

typedef void KMP_MACHINE_CODE routine(double *v);

static kmp_straight operations[MOST];
static uint32_t count;
static double initial[ROOM];

static uint32_t add(kmp_operation op, uint32_t x, uint32_t y, uint32_t z, bool kept)
{
    operations[count] = (kmp_straight){.op = (uint16_t)op, .d = LEAVES + count, .x = x, .y = y, .z = z, .kept = kept};
    return LEAVES + count++;
}

/* The slot of operand number k of a copy: a leaf of its own, a leaf of all, or a value of the copy. */
static uint32_t place(int copy, int k)
{
    return k < 8    ? (uint32_t)(CONSTANTS + 8 * copy + k)
           : k < 12 ? (uint32_t)(k - 8)
                    : LEAVES + (uint32_t)(copy * SIZE + k - 12);
}

static kmp_operation variant(kmp_operation op)
{
    static const kmp_operation three[] = {KMP_DO_PRODUCT_ADD, KMP_DO_PRODUCT_SUB, KMP_DO_SUB_PRODUCT};
    if (pick(8) > 0)
        return op;
    return op == KMP_DO_ADD ? KMP_DO_SUB : kmp_operation_has_three(op) ? three[pick(3)] : op;
}

/* Copies of one random expression, in which some operations vary, then sums over them. `alike`: without variation. */
static void make_copies(bool alike)
{
    static const kmp_operation ops[] = {KMP_DO_ADD,         KMP_DO_MUL, KMP_DO_SUB,         KMP_DO_PRODUCT_ADD,
                                        KMP_DO_ADD,         KMP_DO_MUL, KMP_DO_PRODUCT_SUB, KMP_DO_PRODUCT_ADD,
                                        KMP_DO_SUB_PRODUCT, KMP_DO_MUL, KMP_DO_DIV,         KMP_DO_SQRT};
    kmp_operation op[SIZE];
    int x[SIZE], y[SIZE], z[SIZE];
    count = 0;
    for (int k = 0; k < SIZE; k++) {
        op[k] = ops[pick(16) < 14 ? pick(10) : pick(12)];
        x[k] = pick(12 + k);
        y[k] = pick(3) == 0 ? pick(12 + k) : 12 + k - 1 - pick(k < 20 ? k + 12 : 20);
        z[k] = pick(3) == 0 ? y[k] : pick(12 + k);
    }
    for (int copy = 0; copy < COPIES; copy++)
        for (int k = 0; k < SIZE; k++) {
            bool turn = !alike && pick(6) == 0 && (kmp_operation_commutes(op[k]) || kmp_operation_has_three(op[k]));
            uint32_t a = place(copy, x[k]), b = place(copy, y[k]);
            (void)add(alike ? op[k] : variant(op[k]), turn ? b : a, turn ? a : b, place(copy, z[k]), pick(10) == 0);
        }
    for (int k = 0; k < 20; k++) {
        uint32_t sum = place(0, 12 + pick(SIZE));
        for (int copy = 1; copy < COPIES; copy++)
            sum = add(KMP_DO_ADD, sum, place(copy, 12 + pick(SIZE)), 0, copy == COPIES - 1);
    }
}

static double value(const kmp_straight *s, const double *v)
{
    switch (s->op) {
    case KMP_DO_ADD:
        return v[s->x] + v[s->y];
    case KMP_DO_SUB:
        return v[s->x] - v[s->y];
    case KMP_DO_MUL:
        return v[s->x] * v[s->y];
    case KMP_DO_DIV:
        return v[s->x] / v[s->y];
    case KMP_DO_PRODUCT_ADD:
        return fma(v[s->x], v[s->y], v[s->z]);
    case KMP_DO_PRODUCT_SUB:
        return fma(v[s->x], v[s->y], -v[s->z]);
    case KMP_DO_SUB_PRODUCT:
        return fma(-v[s->x], v[s->y], v[s->z]);
    default:
        return sqrt(v[s->y]);
    }
}

static bool same_bits(double a, double b)
{
    return memcmp(&a, &b, sizeof a) == 0 || (isnan(a) && isnan(b));
}

static int wrong_bits(routine *run, const kmp_packs *packs)
{
    static double v[ROOM], expected[SLOTS];
    int bad = 0;
    memcpy(v, initial, sizeof v);
    memcpy(expected, initial, sizeof expected);
    for (int k = 0; k < packs->constants; k++)
        memcpy(v + packs->constant[k].slot, packs->constant[k].value, sizeof packs->constant[k].value);
    for (uint32_t k = 0; k < count; k++)
        expected[operations[k].d] = value(&operations[k], expected);
    run(v);
    for (uint32_t k = 0; k < count; k++)
        bad += operations[k].kept && !same_bits(v[operations[k].d], expected[operations[k].d]);
    return bad;
}

/* Returns the number of operations with pairs. */
static uint32_t one_program(bool alike)
{
    kmp_written_code code = {.encoder = kmp_encoder_here(), .form = KMP_CODE_ONE};
    kmp_registers registers;
    kmp_arena arena = {0};
    kmp_packs packs;
    uint32_t written;
    const kmp_straight *list = operations;
    make_copies(alike);
    written = count;
    for (int k = 0; k < ROOM; k++)
        initial[k] = k < LEAVES ? between(-2, 2) : NAN;
    CHECK(kmp_packs_init(&packs, &arena, kmp_encoder_here(), SLOTS, initial, 0, CONSTANTS));
    CHECK(kmp_packs_make(&packs, &written, &list));
    CHECK(packs.next + KMP_PLACES <= ROOM);
    CHECK(kmp_registers_init(&registers, &arena, packs.slots, packs.next, written, false));
    kmp_registers_write(&registers, &code, written, list);
    void *pages = kmp_pages_new(code.code, code.size);
    routine *run = NULL;
    memcpy(&run, &pages, sizeof run);
    CHECK(pages != NULL);
    if (pages)
        CHECK(wrong_bits(run, &packs) == 0);
    kmp_pages_free(pages, code.size);
    kmp_arena_free(&arena);
    kmp_written_free(&code);
    return written;
}

static void equal_bits(void)
{
    int shorter = 0;
    if (!kmp_code_runs(KMP_CODE_ONE)) {
        printf("skipped: machine code does not run here\n");
        return;
    }
    random_seed(11);
    for (int k = 0; k < 60; k++)
        shorter += one_program(k % 2 == 0) < count;
    CHECK(shorter >= 30); /* those without variations pair nearly completely */
    for (int k = 0; k < 5; k++) {
        uint32_t written = one_program(true);
        CHECK(written < 0.75 * count);
    }
}

/* Operations that are few stay as they are. */
static void short_pieces(void)
{
    kmp_arena arena = {0};
    kmp_packs packs;
    uint32_t written = 10;
    const kmp_straight *list = operations;
    CHECK(kmp_packs_init(&packs, &arena, kmp_encoder_here(), SLOTS, initial, 0, CONSTANTS));
    CHECK(kmp_packs_make(&packs, &written, &list));
    CHECK(written == 10 && list == operations && packs.next == packs.slots);
    kmp_arena_free(&arena);
}

int main(void)
{
    TEST(equal_bits);
    TEST(short_pieces);
    return check_report();
}
