/* SPDX-License-Identifier: BSD-3-Clause */
#include "backend/wasm/relaxed_sums.h"

#ifdef __wasm__
#include <emscripten.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

/* -- the module -------------------------------------------------------------------------------------- */

/* Instructions. An index is the number of a parameter, a distance one in bytes from an address on the stack. */
#define GET(index)     0x20, index
#define SET(index)     0x21, index
#define NUMBER(value)  0x41, value
#define MULTIPLY_ADD   0xfd, 0x87, 0x02 /* f64x2.relaxed_madd */
#define SPLAT(index)   GET(index), 0xfd, 0x14
#define LOAD(distance) 0xfd, 0x5d, 3, distance /* a double, and zero in the other lane */
#define STORE          0xfd, 0x5b, 3, 0, 0
#define NOT_BELOW      0x4f
#define IS_ZERO        0x45
#define ADD            0x6a
#define SUBTRACT       0x6b
#define SHIFT          0x74
#define BLOCK          0x02, 0x40
#define LOOP           0x03, 0x40
#define EXIT_IF        0x0d, 1
#define AGAIN          0x0c, 0
#define END            0x0b

/* The address of the slot whose number `load`, with its alignment, reads at a distance from the record: v + 8 times the
 * number. */
#define SLOT(load, align, distance) GET(2), GET(0), load, align, distance, NUMBER(3), SHIFT, ADD
#define FROM(load, align, distance) SLOT(load, align, distance), LOAD(0)

/* A function of 88 bytes; `size`: bytes of a number. */
#define RECORDS(load, align, size)                                                                                     \
    88, 0, BLOCK, LOOP, GET(0), GET(1), NOT_BELOW, EXIT_IF, SLOT(load, align, 0), FROM(load, align, size),             \
        FROM(load, align, 2 * (size)), FROM(load, align, 3 * (size)), MULTIPLY_ADD, STORE, GET(0), NUMBER(4 * (size)), \
        ADD, SET(0), AGAIN, END, END, END

/* Two lanes of an array, at the distance in bytes that parameter 4 has; a function of `size` bytes that goes through
 * all lanes, with its operations on x, y and z. */
#define LANES(index)      GET(index), GET(4), ADD
#define LOAD_LANES(index) LANES(index), 0xfd, 0, 3, 0
#define STORE_LANES       0xfd, 0x0b, 3, 0
#define MULTIPLY_SUB      0xfd, 0x88, 0x02 /* f64x2.relaxed_nmadd: z - x y */
#define NEGATE            0xfd, 0xed, 0x01
#define OVER_LANES(size, ...)                                                                                          \
    size, 0, BLOCK, LOOP, GET(4), IS_ZERO, EXIT_IF, GET(4), NUMBER(16), SUBTRACT, SET(4), LANES(0), LOAD_LANES(1),     \
        LOAD_LANES(2), LOAD_LANES(3), __VA_ARGS__, STORE_LANES, AGAIN, END, END, END

/* Sections: types of a sum, of records and of lanes, the memory of Kempe, the types of the functions, their names,
 * their code. */
#define VERSION 0, 'a', 's', 'm', 1, 0, 0, 0
#define TYPES                                                                                                          \
    1, 22, 3, 0x60, 3, 0x7c, 0x7c, 0x7c, 1, 0x7c, 0x60, 3, 0x7f, 0x7f, 0x7f, 0, 0x60, 5, 0x7f, 0x7f, 0x7f, 0x7f, 0x7f, 0
#define MEMORY    2, 8, 1, 1, 'e', 1, 'm', 2, 0, 0
#define FUNCTIONS 3, 7, 6, 0, 1, 1, 2, 2, 2
#define NAMES     7, 25, 6, 1, 's', 0, 0, 1, 'n', 0, 1, 1, 'w', 0, 2, 1, 'a', 0, 3, 1, 'b', 0, 4, 1, 'c', 0, 5
#define CODE      10, 0x85, 3, 6
#define SUM       20, 0, SPLAT(0), SPLAT(1), SPLAT(2), MULTIPLY_ADD, 0xfd, 0x21, 0, END
#define NARROW    RECORDS(0x2f, 1, 2)
#define WIDE      RECORDS(0x28, 2, 4)
#define LANES_ADD OVER_LANES(61, MULTIPLY_ADD)
#define LANES_SUB OVER_LANES(64, NEGATE, MULTIPLY_ADD)
#define SUB_LANES OVER_LANES(61, MULTIPLY_SUB)

static const uint8_t module[] = {VERSION, TYPES,  MEMORY, FUNCTIONS, NAMES,     CODE,
                                 SUM,     NARROW, WIDE,   LANES_ADD, LANES_SUB, SUB_LANES};

/* Puts the functions into the table of function pointers; returns the first one's index, 0: the engine does not
 * know an instruction. */
EM_JS(int, load_sums, (const uint8_t *bytes, size_t size), {
    try {
        const code = new WebAssembly.Module(HEAPU8.slice(bytes, bytes + size));
        const made = new WebAssembly.Instance(code, {e : {m : wasmMemory}});
        const names = "snwabc";
        const first = wasmTable.grow(names.length);
        for (let k = 0; k < names.length; k++)
            wasmTable.set(first + k, made.exports[names[k]]);
        return first;
    } catch (error) {
        return 0;
    }
})

/* -- hard cases -------------------------------------------------------------------------------------- */

/* Numbers a, b, c, and a b + c rounded once, as fma() of a processor gives it: most results change if the product is
 * rounded first, some if the sum is rounded to more bits before; results near the ends of the range, zeros with signs.
 */
static const double hard[][4] = {
    {0x1.0000000000001p+0, 0x1.ffffffffffffep-1, -0x1p+0, -0x1p-104},
    {0x1.0000000000001p+0, 0x1.0000000000001p+0, -0x1.0000000000002p+0, 0x1p-104},
    {0x1.8p+1, 0x1.5555555555555p-2, -0x1p+0, -0x1p-54},
    {0x1.999999999999ap-4, 0x1.4p+3, -0x1p+0, 0x1p-54},
    {-0x1.ba8e69b3623c1p-3, -0x1.7ecf2edfe1b5dp-1, -0x1.2beb8aec129cap-16, 0x1.4ad9f6988a8f5p-3},
    {0x1.9e569cd1e8c1cp+2, 0x1.68a2c478eeb76p-1, -0x1.ae5b64956d65cp-44, 0x1.23d89eaa3b8ffp+2},
    {-0x1.ce92621b24fep+0, 0x1.1a764d46308a9p-3, 0x1.ae3a3a923cddp-3, -0x1.40a32266f692ap-5},
    {-0x1.e8e1dc7d4bcbep-1, -0x1.aeb263d75f002p+0, -0x1.dc0c020a4295ap+43, -0x1.dc0c020a42623p+43},
    {-0x1.58ce9d1592527p-2, 0x1.6f8f5d966fe56p+3, 0x1.32f85d238cd2dp-34, -0x1.ef114ca934495p+1},
    {0x1.c3cb74a5606c7p-1, 0x1.a9e65fbf423aep+2, 0x1.9db8a1bebf259p-29, 0x1.77d1ab38ed417p+2},
    {0x1.d4f6c18f6181bp+0, -0x1.54a261aba5f35p+3, 0x1.901919293a0fdp+52, 0x1.901919293a0e9p+52},
    {0x1.0000000392p+0, 0x1.fffffff8dcp-1, 0x1.02c1b70dbdee1p+53, 0x1.02c1b70dbdee1p+53},
    {0x1.00000001eep+0, 0x1.fffffffc24p-1, 0x1.be7975b293573p+53, 0x1.be7975b293573p+53},
    {0x1.fffffffffffffp+1023, 0x1p+1, -0x1.fffffffffffffp+1023, 0x1.fffffffffffffp+1023},
    {0x1.8p-1022, 0x1p-30, 0x0.0000000000001p-1022, 0x0.0000000600001p-1022},
    {0x0.0000000000001p-1022, 0x1p-1, 0x0.0000000000001p-1022, 0x0.0000000000002p-1022},
    {0x1.fffffffffffffp-1, 0x1p-1022, -0x1p-1022, -0.0},
    {-0x1p-600, 0x1p-600, 0.0, -0.0}};

static bool is_right(double result, const double *expected)
{
    return memcmp(&result, expected, sizeof result) == 0;
}

/* Each function with each case. */
static bool round_once(const kmp_relaxed_sums *sums)
{
    static const uint16_t narrow[4] = {3, 0, 1, 2};
    static const uint32_t wide[4] = {3, 0, 1, 2};
    bool good = true;
    for (size_t k = 0; k < sizeof hard / sizeof *hard; k++) {
        const double a = hard[k][0], b = hard[k][1], c = hard[k][2], *expected = hard[k] + 3;
        const double x[2] = {a, a}, y[2] = {b, b}, z[2] = {c, c}, minus_x[2] = {-a, -a}, minus_z[2] = {-c, -c};
        double v[4] = {a, b, c}, w[4] = {a, b, c}, d[6];
        sums->narrow(narrow, narrow + 4, v);
        sums->wide(wide, wide + 4, w);
        sums->product_add(d, x, y, z, sizeof x);
        sums->product_sub(d + 2, x, y, minus_z, sizeof x);
        sums->sub_product(d + 4, minus_x, y, z, sizeof x);
        good = good && is_right(sums->sum(a, b, c), expected) && is_right(v[3], expected) && is_right(w[3], expected);
        for (int l = 0; l < 6; l++)
            good = good && is_right(d[l], expected);
    }
    return good;
}

const kmp_relaxed_sums *kmp_relaxed_found;
bool kmp_relaxed_tried;

void kmp_relaxed_try(void)
{
    static kmp_relaxed_sums sums;
    const uintptr_t first = (uintptr_t)load_sums(module, sizeof module);
    kmp_relaxed_tried = true;
    if (first == 0)
        return;
    sums = (kmp_relaxed_sums){(double (*)(double, double, double))first,
                              (void (*)(const void *, const void *, double *))(first + 1),
                              (void (*)(const void *, const void *, double *))(first + 2),
                              (kmp_relaxed_lanes *)(first + 3),
                              (kmp_relaxed_lanes *)(first + 4),
                              (kmp_relaxed_lanes *)(first + 5)};
    if (round_once(&sums))
        kmp_relaxed_found = &sums;
}
#endif
