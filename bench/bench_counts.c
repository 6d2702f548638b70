/* SPDX-License-Identifier: BSD-3-Clause */
/* Operations by set (`kempe show --stats` has the same), and of the whole right-hand side of the reduced formulation:
 * the program and the linear algebra on its values, and both as one program. */
#include "bench.h"
#include "constraints/closing/assemble.h"
#include "constraints/programs/reduced_program.h"
#include <kempe/check.h>

static void put(const char *name, kmp_counts c)
{
    printf("  %-28s %6ld %6ld %6ld %6ld %8ld\n", name, c.add, c.mul, c.div, c.other, c.trig);
}

static kmp_counts sum(kmp_counts a, kmp_counts b)
{
    return (kmp_counts){.add = a.add + b.add,
                        .mul = a.mul + b.mul,
                        .div = a.div + b.div,
                        .other = a.other + b.other,
                        .trig = a.trig + b.trig};
}

static void right_hand_side(const bench *b, const char *name)
{
    const kempe_system *s = b->system;
    kempe_assembly *start = NULL;
    kmp_partition part;
    kmp_reduction red;
    kmp_reduced_program *reduced = NULL;
    kmp_evaluator *eval = kmp_eval_new(s, "tape");
    if (!eval || kempe_assembly_new(s, &start) != KEMPE_OK)
        exit(1);
    kmp_eval_closure(eval, 0, start->q);
    if (kmp_partition_init(&part, s, eval->jacobian, NULL, 0) || kmp_reduction_init(&red, eval, &part))
        exit(1);
    kmp_counts program = kmp_program_count(s->motion, 1, s->motion->stages - 1), solves = kmp_reduction_count(&red);
    printf("%s, one right-hand side of the reduced formulation\n", name);
    printf("  %-28s %6s %6s %6s %6s %8s\n", "", "+ -", "*", "/", "sqrt", "sin cos");
    put("program: M, C, h, J, gamma", program);
    put("linear algebra", solves);
    put("together", sum(program, solves));
    if (kmp_reduction_factor(&red) || kmp_reduced_program_new(&reduced, &red, false))
        exit(1);
    if (reduced)
        put("as one program", kmp_program_count(kmp_reduced_program_code(reduced), KMP_REDUCED_PROGRAM_RATES,
                                                KMP_REDUCED_PROGRAM_ACCELERATIONS));
    kmp_reduced_program_free(reduced);
    kmp_reduction_free(&red);
    kmp_partition_free(&part);
    kmp_eval_free(eval);
    kempe_assembly_free(start);
}

int bench_counts(int argc, char **argv)
{
    (void)argc, (void)argv;
    static const char *const names[] = {"andrews", "four_bar", "slider_crank"};
    for (int k = 0; k < 3; k++) {
        char path[128], *text = NULL;
        snprintf(path, sizeof path, "examples/%s/%s.yaml", names[k], names[k]);
        bench b = bench_load(path);
        if (kempe_system_print(b.system, KEMPE_VIEW_STATS, KEMPE_TEXT, &text))
            return 1;
        printf("== %s\n%s\n", names[k], text);
        kempe_text_free(text);
        right_hand_side(&b, names[k]);
        if (k == 0)
            put("specialised by hand", (kmp_counts){.add = 91, .mul = 162, .div = 5, .other = 1});
        printf("\n");
        bench_free(&b);
    }
    return 0;
}
