/* SPDX-License-Identifier: BSD-3-Clause */
/* Graphs of joints: which are cut, and what is said of it. */
#include "constraints/kinds/kind.h"
#include "joint_graphs.h"
#include "model/data/closure_table.h"
#include "model/data/model.h"
#include "testing.h"
#include <kempe/check.h>
#include <math.h>

/* -- the choice ---------------------------------------------------------------------------------------------- */

static int rows_of(const kmp_closure_parts *kind)
{
    return kind->force->rows + kind->moment->rows;
}

static void check_choice(const char *tail, const char *cut, const char *why)
{
    kempe_model *model = read_two(four_bar, tail);
    CHECK(model && model->cut_count == 1);
    if (model && model->cut_count == 1) {
        CHECK_TEXT(model->cuts[0].joint, cut);
        CHECK_TEXT(model->cuts[0].why, why);
        CHECK(model->cuts[0].rows == rows_of(kmp_closure_parts_of(kmp_closure_kind_find(model->cuts[0].closure))));
    }
    kempe_model_free(model);
}

#define HINGES                                                                                                         \
    "joints:\n  A: {revolute: [ground.O, crank.O]}\n  B: {revolute: [crank.B, coupler.O]}\n"                           \
    "  C: {revolute: [coupler.C, rocker.C]}\n"

static void test_choice(void)
{
    check_choice(HINGES "  D: {revolute: [ground.D, rocker.O]}\n", "C",
                 "it is farther from the ground than A, D; it comes after B");
    check_choice(HINGES "  D: {revolute: [ground.D, rocker.O]}\nstart: {q: {C: 1}}\n", "B",
                 "it has no start value, unlike C; it is farther from the ground than A, D");
    check_choice(HINGES "  D: {spherical: [ground.D, rocker.O]}\n", "D",
                 "it has fewer constraint equations than A, B, C");
    check_choice(HINGES "  D: {spherical: [ground.D, rocker.O]}\nrun: {outputs: [lambda(D), q(D.2), reaction(A)]}\n",
                 "D", "it has fewer constraint equations than A, B, C");
    check_choice(HINGES "  D: {spherical: [ground.D, rocker.O], cut: no}\nrun: {independent: [C]}\n", "B",
                 "it is farther from the ground than A; not to be cut: D (cut: no), C (it is given as independent)");
    check_choice(HINGES "  D: {screw: [ground.D, rocker.O], pitch: 1 mm}\nstart: {hold: [C]}\n"
                        "drives: {m: {joint: A, locked: yes}}\n",
                 "B",
                 "the others of its loop are not to be cut: A (drive 'm' moves it), D (a screw cannot be cut), C "
                 "(the start holds it)");
    check_choice(HINGES "  D: {revolute: [ground.D, rocker.O]}\nrun: {outputs: [q(C), reaction(A)]}\n"
                        "sensors: {s: q(C) + moment(B).z, r: qd(C)}\n",
                 "C", "it is farther from the ground than A, D; it comes after B");
    check_choice(HINGES "  D: {revolute: [ground.D, rocker.O]}\nalgebraic: {pull: 2*reaction(A).x}\n", "A",
                 "the expression 2*reaction(A).x needs its reaction");
    check_choice(HINGES "  D: {revolute: [ground.D, rocker.O]}\nstates: {s: {rate: reaction(B).y - s}}\n", "B",
                 "the expression reaction(B).y - s needs its reaction");
    check_choice(HINGES "  D: {revolute: [ground.D, rocker.O]}\nrun: {until: reaction(A).x > q(C)}\n", "C",
                 "it is farther from the ground than A, D; it comes after B");
    check_choice(HINGES "  D: {revolute: [ground.D, rocker.O], cut: yes}\n", "D", "the model prescribes it (cut: yes)");
    check_choice(HINGES "  D: {revolute: [ground.D, rocker.O], cut: no}\n"
                        "loops: {G: {coupler: {B: 1, C: 2}}}\n",
                 "A",
                 "the others of its loop are not to be cut: D (cut: no), C (loop 'G' depends on it), B (loop 'G' "
                 "depends on it)");
}

/* The rows of cuts.def that give the number of rows of their closures. */
static void test_rows(void)
{
    joint_kind kind;
    for (int k = 0; joint_kind_at(k, &kind); k++)
        if (kind.closure) {
            const kmp_closure_parts *closure = kmp_closure_parts_of(kmp_closure_kind_find(kind.closure));
            CHECK(closure && rows_of(closure) == kind.rows);
            CHECK(6 - (int)strlen(kind.chain) / 2 == kind.rows);
        }
}

/* -- start values --------------------------------------------------------------------------------------------- */

/* The arms of a scissor whose roller may stand to either side: all joints have a start value, so that one of a cut
 * joint decides the side, and its rate is that of the motion. By hand: two arms of 1 m pinned at their middles, the
 * lower ends S apart, so that S = cos 30 deg, and M, the angle from one to the other, turns twice as fast as P,
 * backwards. */
static void test_start_of_cut(void)
{
    static const char scissor[] =
        "kempe: 1\ngravity: [0, -9.81, 0]\nground: {points: {O: [0, 0, 0]}}\nbodies:\n"
        "  a: {mass: 10, com: [0.5, 0, 0], inertia: {zz: 1}, points: {low: [0, 0, 0], mid: [0.5, 0, 0]}}\n"
        "  b: {mass: 10, com: [0.5, 0, 0], inertia: {zz: 1}, points: {low: [0, 0, 0], mid: [0.5, 0, 0]}}\n"
        "  roller: {mass: 1, inertia: {zz: 1e-3}, points: {axle: [0, 0, 0]}}\n";
    static const char *const name[] = {"P", "S", "R", "M"};
    static const char *const joint[] = {"revolute: [ground.O, a.low]", "prismatic: [ground.O, roller.axle], axis: x",
                                        "revolute: [roller.axle, b.low]", "revolute: [a.mid, b.mid]"};
    for (int cut = 0; cut < 8; cut++) {
        double first[MOST_COLUMNS], last[MOST_COLUMNS];
        kmp_text text = {0};
        if (cut == 5 || cut == 6) /* of S and R no start value is given there */
            continue;
        kmp_text_printf(&text, "%sjoints:\n", scissor);
        for (int k = 0; k < 4; k++)
            kmp_text_printf(&text, "  %s: {%s%s}\n", name[k], joint[k], k == cut % 4 ? ", cut: yes" : "");
        kmp_text_printf(&text, "start: {q: {P: 30 deg, %s}, qd: {%s: 0.5}}\n",
                        cut < 4 ? "S: 0.9, R: 150 deg, M: 120 deg" : "M: 120 deg", cut < 4 ? name[cut] : "S");
        kmp_text_put(&text, "run: {outputs: [q(P), q(S), q(M), qd(P), qd(S), qd(M)]}\n");
        CHECK(run_text(text.s, NULL, 1e-9, 1e-9, first, last) == 6);
        CHECK(first[0] > 0.4 && first[0] < 0.65);
        CHECK_NEAR(first[1], cos(first[0]), 1e-9);
        CHECK_NEAR(first[2], acos(-1) - 2 * first[0], 1e-9);
        CHECK_NEAR(first[4], -sin(first[0]) * first[3], 1e-9);
        CHECK_NEAR(first[5], -2 * first[3], 1e-9);
        CHECK_NEAR(cut >= 4 || cut == 1 ? first[4] : cut == 0 ? first[3] : cut == 3 ? first[5] : -first[3], 0.5, 1e-9);
        kmp_text_free(&text);
    }
}

/* A loop that can never close, by the links that it has whatever their origins are. */
static void test_too_short(void)
{
    static const char text[] = "kempe: 1\nground: {points: {O: [0, 0, 0], D: [1, 0, 0]}}\nbodies:\n"
                               "  a: {mass: 1, inertia: {zz: 1}, points: {P: [10, 0, 0], Q: [10.5, 0, 0]}}\n"
                               "  b: {mass: 1, inertia: {zz: 1}, points: {P: [-7, 0, 0], Q: [-4, 0, 0]}}\n"
                               "  c: {mass: 1, inertia: {zz: 1}, points: {P: [1, 0, 0], Q: [1.25, 0, 0]}}\n"
                               "joints:\n  A: {revolute: [ground.O, a.P]}\n  B: {revolute: [a.Q, b.P]}\n"
                               "  C: {revolute: [b.Q, c.Q]}\n  D: {revolute: [ground.D, c.P]}\n";
    kempe_model *model = read_text(text);
    kempe_system *system = NULL;
    kempe_check *check = NULL;
    char *said = NULL;
    CHECK(model && kempe_system_new(model, &system) == KEMPE_OK);
    CHECK(system && kempe_check_new(system, &check) != KEMPE_E_MEMORY);
    CHECK(check && kempe_check_print(check, KEMPE_TEXT, &said) == KEMPE_OK);
    CHECK(check_says(said, "joint C (revolute), in the loop"));
    CHECK(check_says(said, "loop 'C' can never close: body 'b' spans 3 m from P to Q, the other links at most 1.75 m: "
                           "1.25 m are missing"));
    kempe_text_free(said);
    kempe_check_free(check);
    kempe_system_free(system);
    kempe_model_free(model);
}

/* Included graphs: names with prefixes, and their ground on a body. */
static void test_included(void)
{
    static const char *const joints[] = {"T", "l_A", "l_B", "r_A", "r_B"};
    kempe_model *model = read_file("tests/models/two_bars.yaml");
    if (!model)
        return;
    CHECK(model->body_count == 6 && model->cut_count == 2);
    for (int b = 1; b < model->body_count; b++)
        CHECK_TEXT(model->bodies[b].joint, joints[b - 1]);
    CHECK_TEXT(model->cuts[0].joint, "l_C");
    CHECK_TEXT(model->cuts[1].joint, "r_C");
    CHECK_TEXT(model->cuts[0].why,
               "it has fewer constraint equations than l_A; not to be cut: l_B (force 'l_brake' acts on it)");
    CHECK_TEXT(model->cuts[1].why,
               "it has fewer constraint equations than r_A; not to be cut: r_B (force 'r_brake' acts on it)");
    CHECK(model->bodies[2].reversed && !model->bodies[3].reversed);
    kempe_model_free(model);
}

int main(void)
{
    context = kempe_context_new();
    TEST(test_choice);
    TEST(test_rows);
    TEST(test_start_of_cut);
    TEST(test_too_short);
    TEST(test_included);
    kempe_context_free(context);
    return check_report();
}
