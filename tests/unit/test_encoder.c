/* SPDX-License-Identifier: BSD-3-Clause */
/* Machine code of random straight-line operations against the same in C, to the bit, in each form: values that live
 * long enough to be spilled, operands in memory and in registers, every register. Its bytes, of each processor, on any
 * machine. */
#include "backend/arm64/arm64.h"
#include "backend/encoder/registers.h"
#include "backend/encoders.h"
#include "backend/x86/x86.h"
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
static kmp_code_address address[SLOTS];

/* Operands are far back at times and mostly near; `reach` is how far. */
static uint32_t operand(int defined, int reach)
{
    int from = pick(3) == 0 ? 0 : defined - 1 - pick(reach < defined ? reach : defined);
    return (uint32_t)(from > 0 ? from : pick(defined));
}

static void make_operations(int count, int reach)
{
    static const kmp_operation ops[] = {
        KMP_DO_ADD,  KMP_DO_SUB,         KMP_DO_MUL, KMP_DO_PRODUCT_ADD, KMP_DO_PRODUCT_SUB, KMP_DO_SQRT, KMP_DO_DIV,
        KMP_DO_LOAD, KMP_DO_SUB_PRODUCT, KMP_DO_ADD, KMP_DO_MUL,         KMP_DO_PRODUCT_ADD, KMP_DO_MAX};
    for (int k = 0; k < count; k++) {
        kmp_straight *s = &operations[k];
        *s = (kmp_straight){.op = (uint16_t)ops[pick(13)], .d = (uint32_t)(LEAVES + k)};
        s->x = operand(LEAVES + k, reach);
        s->y = operand(LEAVES + k, reach);
        s->z = operand(LEAVES + k, reach);
        s->kept = pick(4) == 0;
        if (pick(10) == 0)
            s->y = s->x;
        if (pick(10) == 0)
            s->z = pick(2) == 0 ? s->x : s->y;
        is_read_later[LEAVES + k] = s->kept;
    }
}

static double value(kmp_operation op, double x, double y, double z)
{
    switch (op) {
    case KMP_DO_ADD:
        return x + y;
    case KMP_DO_SUB:
        return x - y;
    case KMP_DO_MUL:
        return x * y;
    case KMP_DO_DIV:
        return x / y;
    case KMP_DO_MAX:
        return x > y ? x : y;
    case KMP_DO_SQRT:
        return sqrt(y);
    case KMP_DO_PRODUCT_ADD:
        return fma(x, y, z);
    case KMP_DO_PRODUCT_SUB:
        return fma(x, y, -z);
    case KMP_DO_SUB_PRODUCT:
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
        address[k] = (kmp_code_address){place % BASES, place / BASES * wide * (int)sizeof(double)};
    }
}

static double *at_address(double part[BASES][SLOTS * WIDEST], int slot)
{
    return part[address[slot].base] + address[slot].distance / (int)sizeof(double);
}

/* Runs code with these addresses on the values of all slots. */
static void run_apart(routine *run, int wide, int at_once, double *v)
{
    static double part[BASES][SLOTS * WIDEST];
    const size_t size = (size_t)wide * sizeof *v;
    for (int k = 0; k < SLOTS; k++)
        memcpy(at_address(part, k), v + k * wide, size);
    for (int l = 0; l < wide; l += at_once)
        run(part[0] + l, part[1] + l, part[2] + l);
    for (int k = 0; k < SLOTS; k++)
        memcpy(v + k * wide, at_address(part, k), size);
}

static int wrong_bits(const kmp_registers *registers, kmp_code_form form, int count, routine *run)
{
    static double v[(SLOTS + KMP_PLACES) * WIDEST], expected[SLOTS * WIDEST];
    int wide = kmp_code_lanes(form), bad = 0;
    for (int k = 0; k < SLOTS * wide; k++)
        v[k] = expected[k] = k < LEAVES * wide ? between(-2, 2) : NAN;
    for (int k = 0; k < count; k++)
        for (int lane = 0; lane < wide; lane++) {
            const kmp_straight *s = &operations[k];
            uint32_t l = (uint32_t)lane, w = (uint32_t)wide;
            expected[(LEAVES + k) * wide + lane] =
                value(s->op, expected[s->x * w + l], expected[s->y * w + l], expected[s->z * w + l]);
        }
    const int at_once = kmp_code_at_once(form);
    if (registers->address)
        run_apart(run, wide, at_once, v);
    for (int l = 0; !registers->address && l < wide; l += at_once)
        run(v + l, NULL, NULL);
    for (int k = 0; k < (LEAVES + count) * wide; k++)
        bad += (k / wide < LEAVES || is_read_later[k / wide]) && !same_bits(v[k], expected[k]);
    return bad;
}

/* Random operations, for a form, with places as the kind of the program has them. */
static void make_program(kmp_registers *registers, kmp_arena *arena, kmp_code_form form, uint32_t *count)
{
    *count = (uint32_t)(1 + pick(MOST));
    make_operations((int)*count, 1 + pick(60));
    const int kind = pick(4); /* 0: values have no places but their slots; 1: these have addresses, too */
    CHECK(kmp_registers_init(registers, arena, SLOTS, SLOTS, MOST, kind < 2));
    scatter(kmp_code_lanes(form));
    registers->address = kind == 1 ? address : NULL;
}

static void one_program(kmp_code_form form)
{
    kmp_written_code code = {.encoder = kmp_encoder_here(), .form = form};
    kmp_registers registers;
    kmp_arena arena = {0};
    uint32_t count;
    make_program(&registers, &arena, form, &count);
    for (int again = 0; again < 2; again++) { /* what one piece leaves behind must not trouble the next */
        size_t begin = code.size;
        kmp_registers_write(&registers, &code, count, operations);
        CHECK(!code.failed && code.size > begin);
        void *pages = kmp_pages_new(code.code + begin, code.size - begin);
        routine *run = NULL;
        memcpy(&run, &pages, sizeof run);
        CHECK(pages != NULL);
        if (pages)
            CHECK(wrong_bits(&registers, form, (int)count, run) == 0);
        kmp_pages_free(pages, code.size - begin);
    }
    kmp_arena_free(&arena);
    kmp_written_free(&code);
}

static void every_form(void)
{
    for (const kmp_code_form *form = kmp_encoder_here()->forms; *form; form++) {
        if (!kmp_code_runs(*form)) {
            printf("skipped: form %d does not run here\n", (int)*form);
            continue;
        }
        random_seed(7);
        for (int k = 0; k < 200; k++)
            one_program(*form);
    }
}

/* The bytes of random programs of a form: their number and FNV's hash of 64 bits. */
typedef struct known_bytes {
    const kmp_encoder *encoder;
    kmp_code_form form;
    size_t size;
    uint64_t hash;
} known_bytes;

static void check_known(const known_bytes *known)
{
    uint64_t hash = UINT64_C(0xcbf29ce484222325);
    size_t size = 0;
    random_seed(7);
    for (int k = 0; k < 200; k++) {
        kmp_written_code code = {.encoder = known->encoder, .form = known->form};
        kmp_registers registers;
        kmp_arena arena = {0};
        uint32_t count;
        make_program(&registers, &arena, known->form, &count);
        kmp_registers_write(&registers, &code, count, operations);
        for (size_t i = 0; i < code.size; i++)
            hash = (hash ^ code.code[i]) * UINT64_C(0x100000001b3);
        size += code.size;
        kmp_arena_free(&arena);
        kmp_written_free(&code);
    }
    CHECK(size == known->size && hash == known->hash);
    if (size != known->size || hash != known->hash)
        printf("%s, form %d: %zu bytes, hash 0x%016llx\n", known->encoder->name, (int)known->form, size,
               (unsigned long long)hash);
}

/* Code as it ran: a change that is not meant changes the hash. Of x86-64, that of a version whose encoder also chose
 * registers. */
static void same_bytes(void)
{
    static const known_bytes known[] = {
        {&kmp_encoder_x86, KMP_CODE_ONE, 445824, UINT64_C(0x44cc42dd0df4ca9b)},
        {&kmp_encoder_x86, KMP_CODE_FOUR, 457161, UINT64_C(0x948beda06ba20097)},
        {&kmp_encoder_x86, KMP_CODE_EIGHT, 425124, UINT64_C(0x8cfbbcda355a01e9)},
        {&kmp_encoder_x86, KMP_CODE_TWO_FOURS, 1154595, UINT64_C(0xb394c1accaf2c717)},
        {&kmp_encoder_x86, KMP_CODE_TWO_EIGHTS, 1082650, UINT64_C(0x593022e4120c2da1)},
        {&kmp_encoder_arm64, KMP_CODE_ONE, 280892, UINT64_C(0xb0bf94e09228fe52)},
        {&kmp_encoder_arm64, KMP_CODE_TWO_TWOS, 781288, UINT64_C(0x4cefcf4134a18d71)},
        {&kmp_encoder_arm64, KMP_CODE_EIGHT_IN_PARTS, 798076, UINT64_C(0xbbc4df3d93eae384)},
        {&kmp_encoder_arm64, KMP_CODE_SIXTEEN_IN_PARTS, 807544, UINT64_C(0x796908ed3879eeff)},
    };
    for (size_t k = 0; k < sizeof known / sizeof *known; k++)
        check_known(&known[k]);
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
    TEST(same_bytes);
    TEST(no_pages);
    return check_report();
}
