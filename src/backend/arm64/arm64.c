/* SPDX-License-Identifier: BSD-3-Clause */
/* Encoding of instructions: each is a word with the numbers of its registers. */
#include "backend/arm64/arm64.h"
#include <string.h>

enum { WORD = 4 };

/* Registers of values, in the order in which they are taken: v0 to v7 and v16 to v30, which a function may overwrite,
 * then v8 to v15, of which it has to restore the lower half. v31 is free between two instructions. */
enum { VALUES = 31, FREE = 31, FIRST_KEPT = 8, LAST_KEPT = 15, KEPT_FROM = 23 };

/* Registers of addresses: x8 to x15 have the ones in `held`, x17 is free between two instructions. */
enum { HELD = 8, NUMBER = 17, STACK = 31 };

/* -- words ------------------------------------------------------------------------------------------- */

static void put(kmp_written_code *c, uint32_t word)
{
    uint8_t *at = kmp_written_room(c, WORD);
    if (!at)
        return;
    for (int k = 0; k < WORD; k++, word >>= 8)
        at[k] = (uint8_t)(word & 255);
    c->size += WORD;
}

/* An instruction with registers d (bits 0 to 4), n (5 to 9) and m (16 to 20). */
static void put_three(kmp_written_code *c, uint32_t word, int d, int n, int m)
{
    put(c, word | (uint32_t)m << 16 | (uint32_t)n << 5 | (uint32_t)d);
}

static void put_two(kmp_written_code *c, uint32_t word, int d, int n)
{
    put_three(c, word, d, n, 0);
}

/* The vector register of number k of a value's registers, of which it has `each`. Notes the ones to be restored. */
static int vector(kmp_written_code *c, int value, int each, int k)
{
    const int number = each * value + k;
    const int v = number < FIRST_KEPT  ? number
                  : number < KEPT_FROM ? number + FIRST_KEPT
                                       : number - KEPT_FROM + FIRST_KEPT;
    if (v >= FIRST_KEPT && v <= LAST_KEPT && v > c->saved)
        c->saved = v;
    return v;
}

static int registers_of(kmp_code_form form)
{
    return form & KMP_CODE_TWO ? 2 : 1;
}

static bool is_packed(kmp_code_form form, kmp_operation op)
{
    return form != KMP_CODE_ONE || op & KMP_DO_PAIR;
}

/* -- operations -------------------------------------------------------------------------------------- */

/* Instructions of an operation: on one double, on two; 0: it has none of this kind. */
typedef struct words {
    uint32_t one, two;
} words;

/* fmov and mov, fsqrt, fadd, fmul, fsub, fdiv, fcmp and fcmgt, dup; eor, zip1, ext, zip2; fmadd and fmla, fnmsub and
 * fmla of a negative, fmsub and fmls. */
static const words instruction[KMP_DO_COUNT] = {
    [KMP_DO_LOAD] = {0x1e604000, 0x4ea01c00},
    [KMP_DO_SQRT] = {0x1e61c000, 0x6ee1f800},
    [KMP_DO_ADD] = {0x1e602800, 0x4e60d400},
    [KMP_DO_MUL] = {0x1e600800, 0x6e60dc00},
    [KMP_DO_SUB] = {0x1e603800, 0x4ee0d400},
    [KMP_DO_DIV] = {0x1e601800, 0x6e60fc00},
    [KMP_DO_MAX] = {0x1e602000, 0x6ee0e400},
    [KMP_DO_TWICE] = {0x4e080400, 0},
    [KMP_DO_XOR & 0xff] = {0, 0x6e201c00},
    [KMP_DO_LOW_LOW & 0xff] = {0, 0x4ec03800},
    [KMP_DO_HIGH_LOW & 0xff] = {0, 0x6e004000},
    [KMP_DO_HIGH_HIGH & 0xff] = {0, 0x4ec07800},
    [KMP_DO_PRODUCT_ADD & 0xff] = {0x1f400000, 0x4e60cc00},
    [KMP_DO_PRODUCT_SUB & 0xff] = {0x1f608000, 0x4e60cc00},
    [KMP_DO_SUB_PRODUCT & 0xff] = {0x1f408000, 0x4ee0cc00},
};
enum { SELECT_GREATER = 0x1e60cc00, NEGATE = 0x6ee0f800, LANE_1 = 0x5e180400, INTO_LANE_0 = 0x6e080400 };
enum { SELECT = 0x6e601c00, INTO_LANE_1 = 0x6e184400 }; /* bsl: bits of n where d has ones, otherwise of m */

static void move(kmp_written_code *c, int d, int n)
{
    if (d != n)
        put_three(c, instruction[KMP_DO_LOAD].two, d, n, n);
}

/* Not fmax, which is NaN if any operand is. */
static void put_larger(kmp_written_code *c, bool packed, int d, int x, int y)
{
    if (!packed) {
        put_three(c, instruction[KMP_DO_MAX].one, 0, x, y);
        put_three(c, SELECT_GREATER, d, x, y);
        return;
    }
    put_three(c, instruction[KMP_DO_MAX].two, FREE, x, y);
    put_three(c, SELECT, FREE, x, y);
    move(c, d, FREE);
}

static void put_operation(kmp_written_code *c, kmp_operation op, int d, int x, int y)
{
    const words *w = &instruction[kmp_operation_row(op)];
    const bool packed = is_packed(c->form, op);
    if (kmp_operation_single(op) == KMP_DO_MAX) {
        put_larger(c, packed, d, x, y);
    } else if (op == KMP_DO_LOW_HIGH && d == y) {
        put_two(c, INTO_LANE_0, d, x);
    } else if (op == KMP_DO_LOW_HIGH) {
        move(c, d, x);
        put_two(c, INTO_LANE_1, d, y);
    } else if (kmp_operation_single(op) == KMP_DO_LOAD && packed) {
        move(c, d, y);
    } else if (kmp_operation_is_unary(op)) {
        put_two(c, packed ? w->two : w->one, d, y);
    } else {
        put_three(c, packed ? w->two : w->one, d, x, y);
    }
}

static void write_registers(kmp_written_code *c, kmp_operation op, int d, int x, int y)
{
    const int each = registers_of(c->form);
    for (int k = 0; k < each; k++)
        put_operation(c, op, vector(c, d, each, k), vector(c, x, each, k), vector(c, y, each, k));
}

/* In pairs the sum replaces its summand, which is first copied, or negated. */
static void put_multiply_add(kmp_written_code *c, kmp_operation op, int d, const int from[3])
{
    const words *w = &instruction[kmp_operation_row(op)];
    const int x = from[0], y = from[1], z = from[2];
    if (!is_packed(c->form, op)) {
        put_three(c, w->one | (uint32_t)z << 10, d, x, y);
        return;
    }
    const bool negates = kmp_operation_single(op) == KMP_DO_PRODUCT_SUB;
    const int sum = (d == x || d == y) && (negates || d != z) ? FREE : d; /* factors are not overwritten */
    if (negates)
        put_two(c, NEGATE, sum, z);
    else
        move(c, sum, z);
    put_three(c, w->two, sum, x, y);
    move(c, d, sum);
}

static void write_three(kmp_written_code *c, kmp_operation op, const kmp_three_sources *s)
{
    const int each = registers_of(c->form);
    for (int k = 0; k < each; k++) {
        int from[3];
        for (int i = 0; i < 3; i++)
            from[i] = vector(c, s->from[i], each, k);
        put_multiply_add(c, op, vector(c, s->d, each, k), from);
    }
}

/* -- memory ------------------------------------------------------------------------------------------ */

/* add with a number, with one that is shifted by 12 bits, and with a register; mov, movn, movk of 16 bits. */
static const uint32_t add_number = 0x91000000, shifted_number = 0x91400000, add_register = 0x8b000000;
static const uint32_t move_number = 0xd2800000, move_not = 0x92800000, move_into = 0xf2800000, upper_half = 1 << 21;
enum { MOST_NUMBER = 4095 };

/* d = n + distance, of addresses. */
static void put_address(kmp_written_code *c, int d, int n, int32_t distance)
{
    const uint32_t number = (uint32_t)distance, low = number & 0xffff, high = number >> 16;
    if (distance >= 0 && distance <= MOST_NUMBER) {
        put_two(c, add_number | number << 10, d, n);
        return;
    }
    if (distance >= 0 && number % 4096 == 0 && number >> 12 <= MOST_NUMBER) {
        put_two(c, shifted_number | number >> 12 << 10, d, n);
        return;
    }
    put_two(c, distance < 0 ? move_not | (~low & 0xffff) << 5 : move_number | low << 5, NUMBER, 0);
    if (high != (distance < 0 ? 0xffffu : 0))
        put_two(c, move_into | upper_half | high << 5, NUMBER, 0);
    put_three(c, add_register, d, n, NUMBER);
}

/* A register with the address of a place, which loads and stores nearby use again. */
static int hold(kmp_written_code *c, kmp_code_address at)
{
    for (int k = 0; k < KMP_CODE_HELD; k++)
        if (c->held[k].base == at.base && c->held[k].distance == at.distance)
            return HELD + k;
    const int k = c->next_held;
    c->next_held = (k + 1) % KMP_CODE_HELD;
    c->held[k] = at;
    put_address(c, HELD + k, at.base, at.distance);
    return HELD + k;
}

/* Loads and stores of one register: with a distance in units of its size; with one in bytes; of two registers. */
typedef struct transfer {
    uint32_t scaled, unscaled, pair;
    int size; /* bytes */
} transfer;

enum { LOAD_ONE, STORE_ONE, LOAD_TWO, STORE_TWO };
static const transfer transfers[] = {
    [LOAD_ONE] = {0xfd400000, 0xfc400000, 0x6d400000, 8},
    [STORE_ONE] = {0xfd000000, 0xfc000000, 0x6d000000, 8},
    [LOAD_TWO] = {0x3dc00000, 0x3cc00000, 0xad400000, 16},
    [STORE_TWO] = {0x3d800000, 0x3c800000, 0xad000000, 16},
};

/* UNIT_MOST: the longest distance in units. WINDOW: bytes from a held address on; units of doubles reach as far. */
enum { UNIT_MOST = 4095, WINDOW = 32768 };

/* True if an instruction reaches the distance, and one that is `further` behind: in units of its size; in bytes. */
static bool reaches(int32_t distance, int size, int32_t further)
{
    return distance >= 0 && distance % size == 0 && distance / size <= UNIT_MOST - further / size;
}

static bool reaches_bytes(int32_t distance, int32_t further)
{
    return distance >= -256 && distance <= 255 - further;
}

static void put_transfer(kmp_written_code *c, const transfer *t, int v, int n, int32_t distance)
{
    if (reaches(distance, t->size, 0))
        put_two(c, t->scaled | (uint32_t)(distance / t->size) << 10, v, n);
    else
        put_two(c, t->unscaled | ((uint32_t)distance & 511) << 12, v, n);
}

/* The register and the distance of a place, for a transfer at it and one that is `further` behind. */
static int reach_place(kmp_written_code *c, const transfer *t, kmp_code_address at, int32_t further, int32_t *distance)
{
    *distance = at.distance;
    if (reaches(at.distance, t->size, further) || reaches_bytes(at.distance, further))
        return at.base;
    const int32_t within = (int32_t)((uint32_t)at.distance % WINDOW), rest = within % t->size;
    *distance = within - rest;
    return hold(c, (kmp_code_address){at.base, at.distance - *distance});
}

enum { PAIR_MOST = 63 };

static void write_memory(kmp_written_code *c, kmp_operation op, int d, int x, kmp_code_address y)
{
    (void)x;
    const int each = registers_of(c->form);
    const bool stores = op == KMP_DO_STORE_HIGH || kmp_operation_single(op) == KMP_DO_STORE;
    const bool packed = op != KMP_DO_STORE_HIGH && is_packed(c->form, op);
    const transfer *t = &transfers[packed ? (stores ? STORE_TWO : LOAD_TWO) : stores ? STORE_ONE : LOAD_ONE];
    int32_t distance;
    const int n = reach_place(c, t, y, (each - 1) * t->size, &distance);
    int first = vector(c, d, each, 0);
    if (op == KMP_DO_STORE_HIGH) {
        put_two(c, LANE_1, FREE, first);
        first = FREE;
    }
    if (each == 1) {
        put_transfer(c, t, first, n, distance);
        return;
    }
    const int second = vector(c, d, each, 1);
    if (distance % t->size == 0 && distance >= 0 && distance / t->size <= PAIR_MOST) {
        put_two(c, t->pair | (uint32_t)(distance / t->size) << 15 | (uint32_t)second << 10, first, n);
        return;
    }
    put_transfer(c, t, first, n, distance);
    put_transfer(c, t, second, n, distance + t->size);
}

/* -- functions --------------------------------------------------------------------------------------- */

static int register_count(kmp_code_form form)
{
    return VALUES / registers_of(form);
}

static const uint32_t return_to_caller = 0xd65f03c0, push_pair = 0x6d800000, pop_pair = 0x6cc00000;

static void put_kept(kmp_written_code *c, uint32_t word, int v, int units)
{
    put_two(c, word | ((uint32_t)units & 127) << 15 | (uint32_t)(v + 1) << 10, v, STACK);
}

/* Functions that took registers to be restored save them at their begin: no instruction depends on its own place. */
static void end(kmp_written_code *c)
{
    const int pairs = c->saved == 0 ? 0 : (c->saved - FIRST_KEPT) / 2 + 1;
    for (int k = pairs - 1; k > 0; k--)
        put_kept(c, transfers[LOAD_ONE].pair, FIRST_KEPT + 2 * k, 2 * k);
    if (pairs > 0)
        put_kept(c, pop_pair, FIRST_KEPT, 2 * pairs);
    put(c, return_to_caller);
    const size_t length = c->size - c->begin, begin = c->begin, saving = WORD * (size_t)pairs;
    if (pairs == 0 || !kmp_written_room(c, saving))
        return;
    memmove(c->code + begin + saving, c->code + begin, length);
    c->size = begin;
    put_kept(c, push_pair, FIRST_KEPT, -2 * pairs);
    for (int k = 1; k < pairs; k++)
        put_kept(c, transfers[STORE_ONE].pair, FIRST_KEPT + 2 * k, 2 * k);
    c->size += length;
}

static bool runs(kmp_code_form form)
{
#if defined(__aarch64__) && defined(__GNUC__) && __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__
    return form == KMP_CODE_ONE || form & KMP_CODE_PARTS || form == KMP_CODE_TWO_TWOS;
#else
    (void)form;
    return false;
#endif
}

static const kmp_code_form forms[] = {KMP_CODE_ONE, KMP_CODE_TWO_TWOS, KMP_CODE_EIGHT_IN_PARTS,
                                      KMP_CODE_SIXTEEN_IN_PARTS, 0};

const kmp_encoder kmp_encoder_arm64 = {.name = "arm64",
                                       .forms = forms,
                                       .mixes_pairs = false,
                                       .reads_memory = false,
                                       .bases = 1,
                                       .runs = runs,
                                       .register_count = register_count,
                                       .registers = write_registers,
                                       .memory = write_memory,
                                       .three = write_three,
                                       .end = end};
