/* SPDX-License-Identifier: BSD-3-Clause */
/* Prints instructions of the encoder of arm64, one case a line, for arm64_words.py:
 *
 *     registers FORM OPERATION D X Y : WORDS      three FORM OPERATION D X Y Z : WORDS
 *     memory FORM OPERATION D BASE DISTANCE : WORDS    function FORM REGISTERS : WORDS
 */
#include "backend/arm64/arm64.h"
#include <stdio.h>

enum { FIRST = 0, MIDDLE = 11, LAST = 30, LAST_OF_TWO = 14, OPERATIONS = 19 };

typedef struct named {
    const char *name;
    kmp_operation op;
} named;

static const named operations[] = {{"LOAD", KMP_DO_LOAD},
                                   {"SQRT", KMP_DO_SQRT},
                                   {"ADD", KMP_DO_ADD},
                                   {"MUL", KMP_DO_MUL},
                                   {"SUB", KMP_DO_SUB},
                                   {"DIV", KMP_DO_DIV},
                                   {"MAX", KMP_DO_MAX},
                                   {"TWICE", KMP_DO_TWICE},
                                   {"XOR", KMP_DO_XOR},
                                   {"LOW_LOW", KMP_DO_LOW_LOW},
                                   {"LOW_HIGH", KMP_DO_LOW_HIGH},
                                   {"HIGH_LOW", KMP_DO_HIGH_LOW},
                                   {"HIGH_HIGH", KMP_DO_HIGH_HIGH}};
static const named multiply_adds[] = {
    {"PRODUCT_ADD", KMP_DO_PRODUCT_ADD}, {"PRODUCT_SUB", KMP_DO_PRODUCT_SUB}, {"SUB_PRODUCT", KMP_DO_SUB_PRODUCT}};
static const named moves[] = {{"LOAD", KMP_DO_LOAD}, {"STORE", KMP_DO_STORE}, {"STORE_HIGH", KMP_DO_STORE_HIGH}};

#define COUNT(list) ((int)(sizeof(list) / sizeof *(list)))

static kmp_written_code begun(kmp_code_form form)
{
    kmp_written_code c = {.encoder = &kmp_encoder_arm64, .form = form};
    kmp_written_begin(&c);
    return c;
}

/* Ends the line of a case. */
static void print_words(kmp_written_code *c)
{
    (void)printf(" :");
    for (size_t k = 0; k + 3 < c->size; k += 4)
        (void)printf(" %02x%02x%02x%02x", c->code[k + 3], c->code[k + 2], c->code[k + 1], c->code[k]);
    (void)printf("\n");
    kmp_written_free(c);
}

static void print_registers(kmp_code_form form, const named *what, unsigned pair, int d, int x, int y)
{
    kmp_written_code c = begun(form);
    c.encoder->registers(&c, what->op | pair, d, x, y);
    (void)printf("registers %d %s%s %d %d %d", (int)form, what->name, pair ? "_PAIR" : "", d, x, y);
    print_words(&c);
}

static void print_three(kmp_code_form form, const named *what, unsigned pair, const int r[4])
{
    kmp_written_code c = begun(form);
    const kmp_three_sources s = {.d = r[0], .from = {r[1], r[2], r[3]}};
    c.encoder->three(&c, what->op | pair, &s);
    (void)printf("three %d %s%s %d %d %d %d", (int)form, what->name, pair ? "_PAIR" : "", r[0], r[1], r[2], r[3]);
    print_words(&c);
}

static void print_memory(kmp_code_form form, const named *what, unsigned pair, int d, kmp_code_address at)
{
    kmp_written_code c = begun(form);
    c.encoder->memory(&c, what->op | pair, d, 0, at);
    (void)printf("memory %d %s%s %d %d %ld", (int)form, what->name, pair ? "_PAIR" : "", d, at.base, (long)at.distance);
    print_words(&c);
}

/* Each operation with all that its registers may have in common, at both ends of the list of registers. */
static void every_operation(kmp_code_form form, unsigned pair)
{
    const int last = form == KMP_CODE_ONE ? LAST : LAST_OF_TWO;
    const int place[] = {FIRST, MIDDLE, last};
    for (int n = 0; n < 27; n++) {
        const int d = place[n % 3], x = place[n / 3 % 3], y = place[n / 9];
        for (int k = 0; k < COUNT(operations); k++) {
            const bool lanes = operations[k].op == KMP_DO_TWICE || operations[k].op & KMP_DO_PAIR;
            if (!lanes || (form == KMP_CODE_ONE && !pair))
                print_registers(form, &operations[k], lanes ? 0 : pair, d, x, y);
        }
    }
    for (int n = 0; n < 256; n++) {
        const int four[] = {FIRST, 5, MIDDLE, last};
        const int r[] = {four[n % 4], four[n / 4 % 4], four[n / 16 % 4], four[n / 64]};
        for (int k = 0; k < COUNT(multiply_adds); k++)
            print_three(form, &multiply_adds[k], pair, r);
    }
}

static void every_distance(kmp_code_form form, unsigned pair)
{
    static const int32_t distances[] = {0,     8,     16,     248,      256,      496,        504,
                                        1008,  1024,  4088,   32752,    32760,    32768,      32776,
                                        65520, 65536, 131064, 16777208, 16777216, 1073741824, 2147483632,
                                        -8,    -256,  -264,   -32768,   -65536,   -65544,     -1073741816};
    for (int k = 0; k < COUNT(distances); k++)
        for (int m = 0; m < COUNT(moves); m++)
            for (int base = 0; base < 4; base += 3)
                if (moves[m].op != KMP_DO_STORE_HIGH || (form == KMP_CODE_ONE && !pair))
                    print_memory(form, &moves[m], pair, k % LAST_OF_TWO, (kmp_code_address){base, distances[k]});
}

static void every_function(kmp_code_form form)
{
    const int registers = form == KMP_CODE_ONE ? LAST + 1 : LAST_OF_TWO + 1;
    const kmp_operation op = KMP_DO_ADD;
    for (int count = 1; count <= registers; count++) {
        kmp_written_code c = begun(form);
        for (int k = 0; k < count; k++)
            c.encoder->registers(&c, op, k, k, k);
        c.encoder->end(&c);
        (void)printf("function %d %d", (int)form, count);
        print_words(&c);
    }
}

int main(void)
{
    every_operation(KMP_CODE_ONE, 0);
    every_operation(KMP_CODE_ONE, KMP_DO_PAIR);
    every_operation(KMP_CODE_TWO_TWOS, 0);
    every_distance(KMP_CODE_ONE, 0);
    every_distance(KMP_CODE_ONE, KMP_DO_PAIR);
    every_distance(KMP_CODE_EIGHT_IN_PARTS, 0);
    every_function(KMP_CODE_ONE);
    every_function(KMP_CODE_TWO_TWOS);
    return 0;
}
