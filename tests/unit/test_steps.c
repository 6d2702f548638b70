/* SPDX-License-Identifier: BSD-3-Clause */
/* Vector step indices: of small programs by hand, and of the pendulum of Fisette and Samin 1996, section 3.2. */
#include "dynamics/equations.h"
#include "dynamics/kinematics/link_tree.h"
#include "studies/show/sets.h"
#include "symbolic/function_table.h"
#include "symbolic/program.h"
#include "testing.h"

static int steps_of(kmp_graph *g, int count, const kmp_ref *out)
{
    kmp_program *p = kmp_program_new(g, 1, &count, &out);
    int steps = (int)kmp_program_steps(p).vector;
    kmp_program_free(p);
    return steps;
}

/* B = x y, C = B + z; B2 = x z, C2 = B + B2; R = C C2: what stands in one assignment alone has no step of its own. */
static void by_hand(void)
{
    kmp_graph *g = kmp_graph_new();
    kmp_ref x = kmp_input(g, KMP_IN_QD, 0), y = kmp_input(g, KMP_IN_QD, 1), z = kmp_input(g, KMP_IN_QD, 2);
    kmp_ref b = kmp_mul(g, x, y), c = kmp_add(g, b, z), c2 = kmp_add(g, b, kmp_mul(g, x, z));
    kmp_ref r = kmp_mul(g, c, c2);
    const kmp_ref all[4] = {b, c, c2, r};
    CHECK(steps_of(g, 1, all) == 1);
    CHECK(steps_of(g, 2, all) == 2);
    CHECK(steps_of(g, 3, all) == 2); /* C and C2 at once */
    CHECK(steps_of(g, 4, all) == 3);
    CHECK(steps_of(g, 1, &r) == 2); /* C and C2 within R */
    kmp_ref turned = kmp_mul(g, kmp_sin(g, kmp_add(g, kmp_input(g, KMP_IN_Q, 0), kmp_input(g, KMP_IN_Q, 1))), x);
    CHECK(steps_of(g, 1, &turned) == 1); /* sines of angles are there at the beginning */
    kmp_graph_free(g);
}

/* Three bodies on R1 R2 R3 joints, by the paper's scheme, diagonal inertias: the paper has 18 vector
 * steps, base parameters save one. */
static void pendulum_of_the_paper(void)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    kmp_tally tally = {0};
    CHECK(kempe_model_read(context, KEMPE_ROOT "/tests/models/pendulum9.yaml", &model) == KEMPE_OK);
    for (int k = 0; model && k < 2; k++) {
        const kmp_derivation_request scene = {.scheme = KMP_SCHEME_NER,
                                              .keep = k ? KMP_KEEP_NUMBERS : KMP_KEEP_NOTHING};
        CHECK(kmp_tally_sets(model, &scene, kmp_sets_find("M_C", 3), &tally) == KEMPE_OK);
        CHECK(tally.steps.vector == 17);
        printf("   %ld operations, %d assignments in %d steps\n", tally.counts.paper, (int)tally.steps.serial,
               (int)tally.steps.vector);
    }
    kempe_model_free(model);
    kempe_context_free(context);
}

int main(void)
{
    TEST(by_hand);
    TEST(pendulum_of_the_paper);
    return check_report();
}
