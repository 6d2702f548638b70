/* SPDX-License-Identifier: BSD-3-Clause */
/* Encoding of instructions: prefix, opcode, registers or an address with the shortest distance. */
#include "backend/x86/x86.h"
#include "base/clones.h"

enum { LONGEST = 16, SHORT = 128 /* least and, but one, greatest distance in a byte */ };

/* rdi, then registers whose number needs no prefix: rsi, rdx, rcx, rax, which a function may overwrite; and rbx, rbp,
 * from SAVED on, which it has to restore. */
static const int base_register[KMP_CODE_BASES] = {7, 6, 2, 1, 0, 3, 5};
enum { SAVED = 5 };

/* An instruction is its opcode; then a bit for operations on pairs of doubles, in the form of one double, as of
 * kmp_operation; a bit for operations of three sources, whose opcode is without the bits for the order of the sources;
 * then bits that follow as a byte. */
enum { PAIR = KMP_DO_PAIR, THREE = KMP_DO_THREE, LOAD = 0x10, STORE = 0x11, SQRT = 0x51, ADD = 0x58, MUL = 0x59 };
enum { TWICE = 0x12, LOAD_HIGH = 0x116, STORE_HIGH = 0x117 };
static const uint16_t instruction[KMP_DO_COUNT] = {
    [KMP_DO_LOAD] = LOAD,
    [KMP_DO_STORE] = STORE,
    [KMP_DO_SQRT] = SQRT,
    [KMP_DO_ADD] = ADD,
    [KMP_DO_MUL] = MUL,
    [KMP_DO_SUB] = 0x5c,
    [KMP_DO_DIV] = 0x5e,
    [KMP_DO_MAX] = 0x5f,
    [KMP_DO_TWICE] = TWICE,
    [KMP_DO_SUB_ADD & 0xff] = 0x1d0,
    [KMP_DO_XOR & 0xff] = 0x157,
    [KMP_DO_LOW_LOW & 0xff] = 0x114,
    [KMP_DO_LOW_HIGH & 0xff] = 0x21c6,
    [KMP_DO_HIGH_LOW & 0xff] = 0x11c6,
    [KMP_DO_HIGH_HIGH & 0xff] = 0x115,
    [KMP_DO_LOAD_HIGH & 0xff] = LOAD_HIGH,
    [KMP_DO_STORE_HIGH & 0xff] = STORE_HIGH,
    [KMP_DO_PRODUCT_ADD & 0xff] = 0x208,
    [KMP_DO_PRODUCT_SUB & 0xff] = 0x20a,
    [KMP_DO_SUB_PRODUCT & 0xff] = 0x20c,
    [KMP_DO_PRODUCT_SUB_ADD & 0xff] = 0x306,
    [KMP_DO_PRODUCT_ADD_SUB & 0xff] = 0x307,
};

static int instruction_of(kmp_operation op)
{
    return instruction[kmp_operation_row(op)] | ((int)op & PAIR);
}

static int without_pair(int op)
{
    return op & ~PAIR;
}

/* True for registers of eight doubles. */
static bool has_eights(kmp_code_form form)
{
    return form == KMP_CODE_EIGHT || form == KMP_CODE_TWO_EIGHTS;
}

/* The second of two registers: its number after the number of the first one; its place in memory. */
static int second_register(kmp_code_form form)
{
    return has_eights(form) ? 16 : 8;
}

static uint8_t *put(uint8_t *at, int byte)
{
    *at = (uint8_t)byte;
    return at + 1;
}

static uint8_t *put_32(uint8_t *at, int32_t x)
{
    uint32_t u = (uint32_t)x;
    for (int k = 0; k < 4; k++, u >>= 8)
        at = put(at, (int)(u & 255));
    return at;
}

/* Ends an instruction. */
static void finish(kmp_written_code *c, const uint8_t *end)
{
    c->size = (size_t)(end - c->code);
}

static bool is_packed(kmp_code_form form, int op)
{
    return form != KMP_CODE_ONE || op & PAIR;
}

/* Loads and stores have no second source; a packed square root has none either. */
static bool has_source(kmp_code_form form, int op)
{
    const int single = without_pair(op);
    return single != LOAD && single != STORE && op != TWICE && op != STORE_HIGH &&
           !(single == SQRT && is_packed(form, op));
}

/* Prefix for registers d (ModRM.reg), x (vvvv) and y (ModRM.rm), followed by the opcode. Bits of registers are
 * inverted. Operations of three sources are in the second table of opcodes, 0f 38, with W = 1. */
static inline uint8_t *put_prefix(uint8_t *at, kmp_code_form form, int op, int d, int x, int y)
{
    int r = !(d & 8), b = !(y & 8), source = has_source(form, op) ? ~x & 31 : 31, v = source & 15;
    bool three = op & THREE;
    int wide = form != KMP_CODE_ONE, pp = three || is_packed(form, op) ? 1 : 3, table = three ? 2 : 1;
    if (has_eights(form)) {
        at = put(at, 0x62);
        at = put(at, r << 7 | (y < 16) << 6 | b << 5 | (d < 16) << 4 | table);
        at = put(at, 1 << 7 | v << 3 | 1 << 2 | pp);
        at = put(at, 2 << 5 | source >> 4 << 3);
    } else if (b && !three) {
        at = put(at, 0xc5);
        at = put(at, r << 7 | v << 3 | wide << 2 | pp);
    } else {
        at = put(at, 0xc4);
        at = put(at, r << 7 | 1 << 6 | b << 5 | table);
        at = put(at, (three ? 1 << 7 : 0) | v << 3 | wide << 2 | pp);
    }
    return put(at, (int)op & 255);
}

static uint8_t *put_bits(uint8_t *at, int op)
{
    return op >> 12 ? put(at, (int)op >> 12) : at;
}

static inline void put_registers(kmp_written_code *c, kmp_code_form form, int op, int d, int x, int y)
{
    uint8_t *at = kmp_written_room(c, LONGEST);
    if (!at)
        return;
    const bool commutes = without_pair(op) == ADD || without_pair(op) == MUL;
    if (commutes && x < 8 && y >= 8) { /* a byte less */
        int z = x;
        x = y;
        y = z;
    }
    at = put_prefix(at, form, op, d, x, y);
    at = put(at, 3 << 6 | (d & 7) << 3 | (y & 7));
    finish(c, put_bits(at, op));
}

/* Most code is of the form of one double. */
static void use_registers(kmp_written_code *c, int op, int d, int x, int y)
{
    if (c->form == KMP_CODE_ONE) {
        put_registers(c, KMP_CODE_ONE, op, d, x, y);
        return;
    }
    put_registers(c, c->form, op, d, x, y);
    int second = second_register(c->form);
    if (c->form & KMP_CODE_TWO)
        put_registers(c, c->form, op, d + second, x + second, y + second);
}

/* Bytes by which short distances count. */
static int32_t unit_of(kmp_code_form form)
{
    return has_eights(form) ? 64 : 1;
}

static inline void put_memory(kmp_written_code *c, kmp_code_form form, int op, int d, int x, int base, int32_t y)
{
    int32_t unit = unit_of(form);
    bool is_short = y % unit == 0 && y / unit >= -SHORT && y / unit < SHORT;
    uint8_t *at = kmp_written_room(c, LONGEST);
    if (!at)
        return;
    at = put_prefix(at, form, op, d, x, 0);
    at = put(at, (is_short ? 1 : 2) << 6 | (d & 7) << 3 | base_register[base]);
    at = is_short ? put(at, (int)(y / unit) & 255) : put_32(at, y);
    finish(c, put_bits(at, op));
}

static void use_memory(kmp_written_code *c, int op, int d, int x, int base, int32_t y)
{
    if (c->form == KMP_CODE_ONE) {
        put_memory(c, KMP_CODE_ONE, op, d, x, base, y);
        return;
    }
    put_memory(c, c->form, op, d, x, base, y);
    int second = second_register(c->form);
    if (c->form & KMP_CODE_TWO)
        put_memory(c, c->form, op, d + second, x + second, base,
                   y + kmp_code_lanes(c->form) / 2 * (int32_t)sizeof(double));
}

static void write_registers(kmp_written_code *c, kmp_operation op, int d, int x, int y)
{
    use_registers(c, instruction_of(op), d, x, y);
}

static void write_memory(kmp_written_code *c, kmp_operation op, int d, int x, kmp_code_address y)
{
    use_memory(c, instruction_of(op), d, x, y.base, y.distance);
}

/* The source whose register receives the result, with the source that may be in memory: x and y, x and z, z and y.
 * Factors may exchange their names. */
typedef enum operand_order { INTO_X_WITH_Y, INTO_X_WITH_Z, INTO_Z_WITH_Y } operand_order;

/* Opcodes 98, a8 and b8 to 9d, ad and bd, odd for a single double; 96 and 97, a6 .. for pairs that differ in sign. */
static int ordered(kmp_code_form form, int op, operand_order order)
{
    static const int bits[] = {0x90, 0xa0, 0xb0};
    return op | bits[order] | !is_packed(form, op);
}

static void write_three(kmp_written_code *c, kmp_operation op, const kmp_three_sources *s)
{
    const int *from = s->from, into = s->into;
    const int third = into == 2 ? (from[0] < 0 ? 0 : 1) : from[2] < 0 ? 2 : 1 - into, other = 3 - into - third;
    const operand_order order = into == 2 ? INTO_Z_WITH_Y : third == 2 ? INTO_X_WITH_Z : INTO_X_WITH_Y;
    const int written = ordered(c->form, instruction_of(op), order);
    if (from[third] >= 0)
        use_registers(c, written, s->d, from[other], from[third]);
    else
        use_memory(c, written, s->d, from[other], s->at.base, s->at.distance);
}

static void set_base(kmp_written_code *c, int base, int32_t distance)
{
    uint8_t *at = kmp_written_room(c, LONGEST);
    if (!at)
        return;
    if (base >= SAVED)
        at = put(at, 0x50 + base_register[base]); /* push */
    c->saved = base >= SAVED ? base : c->saved;
    at = put(at, 0x48); /* lea */
    at = put(at, 0x8d);
    at = put(at, 2 << 6 | base_register[base] << 3 | base_register[0]);
    finish(c, put_32(at, distance));
}

static int register_count(kmp_code_form form)
{
    int registers = has_eights(form) ? 32 : 16;
    return form & KMP_CODE_TWO ? registers / 2 : registers;
}

static int reach(kmp_code_form form)
{
    return 2 * SHORT * unit_of(form) / (8 * kmp_code_lanes(form));
}

static void end(kmp_written_code *c)
{
    uint8_t *at = kmp_written_room(c, LONGEST);
    if (!at)
        return;
    if (c->form != KMP_CODE_ONE) { /* vzeroupper */
        at = put(at, 0xc5);
        at = put(at, 0xf8);
        at = put(at, 0x77);
    }
    for (; c->saved >= SAVED; c->saved--)
        at = put(at, 0x58 + base_register[c->saved]); /* pop */
    c->saved = 0;
    finish(c, put(at, 0xc3));
}

static bool runs(kmp_code_form form)
{
#if defined(__x86_64__) && defined(__GNUC__)
    bool wide = has_eights(form) ? kmp_has_eight() : __builtin_cpu_supports("avx");
    return wide && __builtin_cpu_supports("fma");
#else
    (void)form;
    return false;
#endif
}

static const kmp_code_form forms[] = {KMP_CODE_ONE,       KMP_CODE_FOUR,       KMP_CODE_EIGHT,
                                      KMP_CODE_TWO_FOURS, KMP_CODE_TWO_EIGHTS, 0};

const kmp_encoder kmp_encoder_x86 = {.name = "x86-64",
                                     .forms = forms,
                                     .mixes_pairs = true,
                                     .reads_memory = true,
                                     .bases = KMP_CODE_BASES,
                                     .runs = runs,
                                     .register_count = register_count,
                                     .reach = reach,
                                     .set_base = set_base,
                                     .registers = write_registers,
                                     .memory = write_memory,
                                     .three = write_three,
                                     .end = end};
