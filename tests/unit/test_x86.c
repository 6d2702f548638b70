/* SPDX-License-Identifier: BSD-3-Clause */
/* Machine code of random straight-line operations against the same in C, to the bit, in each form: values that live
 * long enough to be spilled, operands in memory and in registers, every register. */
#include "backend/x86/registers.h"
#include "base/clones.h"
#include "platform/platform.h"
#include "random.h"
#include "testing.h"
#include <math.h>
#include <string.h>

enum { LEAVES = 24, MOST = 400, SLOTS = LEAVES + MOST, WIDEST = 16, BASES = 3 };

/* More arguments are the bases of addresses. */
typedef void KMP_MACHINE_CODE routine(double *v, double *second, double *third);

static kmp_straight operations[MOST];
static bool is_read_later[SLOTS];
static kmp_x86_address address[SLOTS];

/* Operands are far back at times and mostly near; `reach` is how far. */
static uint32_t operand(int defined, int reach)
{
    int from = pick(3) == 0 ? 0 : defined - 1 - pick(reach < defined ? reach : defined);
    return (uint32_t)(from > 0 ? from : pick(defined));
}

static void make_operations(int count, int reach)
{
    static const kmp_x86_op ops[] = {KMP_X86_ADD,         KMP_X86_SUB,  KMP_X86_MUL, KMP_X86_PRODUCT_ADD,
                                     KMP_X86_PRODUCT_SUB, KMP_X86_SQRT, KMP_X86_DIV, KMP_X86_LOAD,
                                     KMP_X86_SUB_PRODUCT, KMP_X86_ADD,  KMP_X86_MUL, KMP_X86_PRODUCT_ADD,
                                     KMP_X86_MAX};
    for (int k = 0; k < count; k++) {
        kmp_straight *s = &operations[k];
        *s = (kmp_straight){.op = (uint16_t)ops[pick(13)],
                            .d = (uint32_t)(LEAVES + k),
                            .x = operand(LEAVES + k, reach),
                            .y = operand(LEAVES + k, reach),
                            .z = operand(LEAVES + k, reach),
                            .kept = pick(4) == 0};
        if (pick(10) == 0)
            s->y = s->x;
        if (pick(10) == 0)
            s->z = pick(2) == 0 ? s->x : s->y;
        is_read_later[LEAVES + k] = s->kept;
    }
}

static double value(kmp_x86_op op, double x, double y, double z)
{
    switch (op) {
    case KMP_X86_ADD:
        return x + y;
    case KMP_X86_SUB:
        return x - y;
    case KMP_X86_MUL:
        return x * y;
    case KMP_X86_DIV:
        return x / y;
    case KMP_X86_MAX:
        return x > y ? x : y;
    case KMP_X86_SQRT:
        return sqrt(y);
    case KMP_X86_PRODUCT_ADD:
        return fma(x, y, z);
    case KMP_X86_PRODUCT_SUB:
        return fma(x, y, -z);
    case KMP_X86_SUB_PRODUCT:
        return fma(-x, y, z);
    default:
        return y;
    }
}

static bool same_bits(double a, double b)
{
    return memcmp(&a, &b, sizeof a) == 0 || (isnan(a) && isnan(b));
}

/* Slots in three arrays, in an order of their own. */
static void scatter(int wide)
{
    for (int k = 0; k < SLOTS; k++) {
        int place = k * 7 % SLOTS;
        address[k] = (kmp_x86_address){place % BASES, place / BASES * wide * (int)sizeof(double)};
    }
}

static double *at_address(double part[BASES][SLOTS * WIDEST], int slot)
{
    return part[address[slot].base] + address[slot].distance / (int)sizeof(double);
}

/* Runs code with these addresses on the values of all slots. */
static void run_apart(routine *run, int wide, double *v)
{
    static double part[BASES][SLOTS * WIDEST];
    const size_t size = (size_t)wide * sizeof *v;
    for (int k = 0; k < SLOTS; k++)
        memcpy(at_address(part, k), v + k * wide, size);
    run(part[0], part[1], part[2]);
    for (int k = 0; k < SLOTS; k++)
        memcpy(v + k * wide, at_address(part, k), size);
}

static int wrong_bits(const kmp_registers *registers, kmp_x86_form form, int count, routine *run)
{
    static double v[(SLOTS + KMP_PLACES) * WIDEST], expected[SLOTS * WIDEST];
    int wide = kmp_x86_lanes(form), bad = 0;
    for (int k = 0; k < SLOTS * wide; k++)
        v[k] = expected[k] = k < LEAVES * wide ? between(-2, 2) : NAN;
    for (int k = 0; k < count; k++)
        for (int lane = 0; lane < wide; lane++) {
            const kmp_straight *s = &operations[k];
            uint32_t l = (uint32_t)lane, w = (uint32_t)wide;
            expected[(LEAVES + k) * wide + lane] =
                value(s->op, expected[s->x * w + l], expected[s->y * w + l], expected[s->z * w + l]);
        }
    if (registers->address)
        run_apart(run, wide, v);
    else
        run(v, NULL, NULL);
    for (int k = 0; k < (LEAVES + count) * wide; k++)
        bad += (k / wide < LEAVES || is_read_later[k / wide]) && !same_bits(v[k], expected[k]);
    return bad;
}

static void one_program(kmp_x86_form form, int count, int reach)
{
    kmp_x86 code = {.form = form};
    kmp_registers registers;
    kmp_arena arena = {0};
    make_operations(count, reach);
    const int kind = pick(4); /* 0: values have no places but their slots; 1: these have addresses, too */
    CHECK(kmp_registers_init(&registers, &arena, SLOTS, SLOTS, MOST, kind < 2));
    scatter(kmp_x86_lanes(form));
    registers.address = kind == 1 ? address : NULL;
    for (int again = 0; again < 2; again++) { /* what one piece leaves behind must not trouble the next */
        size_t begin = code.size;
        kmp_registers_write(&registers, &code, (uint32_t)count, operations);
        CHECK(!code.failed && code.size > begin);
        void *pages = kmp_pages_new(code.code + begin, code.size - begin);
        routine *run = NULL;
        memcpy(&run, &pages, sizeof run);
        CHECK(pages != NULL);
        if (pages)
            CHECK(wrong_bits(&registers, form, count, run) == 0);
        kmp_pages_free(pages, code.size - begin);
    }
    kmp_arena_free(&arena);
    kmp_x86_free(&code);
}

static void every_form(void)
{
    static const kmp_x86_form forms[] = {KMP_X86_ONE, KMP_X86_FOUR, KMP_X86_EIGHT, KMP_X86_TWO_FOURS,
                                         KMP_X86_TWO_EIGHTS};
    for (size_t f = 0; f < sizeof forms / sizeof *forms; f++) {
        if (!kmp_x86_runs(forms[f])) {
            printf("skipped: form %d does not run here\n", (int)forms[f]);
            continue;
        }
        random_seed(7);
        for (int k = 0; k < 200; k++)
            one_program(forms[f], 1 + pick(MOST), 1 + pick(60));
    }
}

/* If code may not run there is a tape: pages of size zero may do anything. */
static void no_pages(void)
{
    CHECK(kmp_pages_new("", 0) == NULL);
    kmp_pages_free(NULL, 0);
}

int main(void)
{
    TEST(every_form);
    TEST(no_pages);
    return check_report();
}
