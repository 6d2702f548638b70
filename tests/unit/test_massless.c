/* SPDX-License-Identifier: BSD-3-Clause */
/* Motions that carry no mass are named: at their place where the tree shows them, by the reduced mass otherwise.
 * Bodies of loops, driven ones and those that carry others may do without. */
#include "testing.h"
#include <kempe/kempe.h>

#define HEAD "kempe: 1\nground: {points: {D: [2, 0, 0]}}\nbodies:\n"
#define ARM  "  a: {joint: {name: A, revolute: z, at: ground}, mass: 1, com: [1, 0, 0], points: {B: [1, 0, 0]}}\n"

/* The message of a short run; "" when it succeeds. */
static const char *said(const char *text)
{
    static char sentence[400];
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    kempe_system *system = NULL;
    kempe_trajectory *trajectory = NULL;
    kempe_run_options run = {0};
    run.t_end = 0.01;
    sentence[0] = '\0';
    CHECK(kempe_model_read_text(context, text, "text", &model) == KEMPE_OK);
    if (model && (kempe_system_new(model, &system) || kempe_simulate(system, &run, &trajectory)))
        snprintf(sentence, sizeof sentence, "%s",
                 trajectory ? kempe_trajectory_reason(trajectory) : kempe_context_message(context));
    kempe_trajectory_free(trajectory);
    kempe_system_free(system);
    kempe_model_free(model);
    kempe_context_free(context);
    return sentence;
}

static void the_tree_shows_it(void)
{
    CHECK_TEXT(said(HEAD ARM "  b: {joint: {name: B, revolute: z, at: a.B}}\n"),
               "text:5:3: joint 'B' moves no mass: its body has neither mass nor inertia");
    CHECK_TEXT(said(HEAD ARM "  b: {joint: {name: B, revolute: z, at: a.B}, mass: 1}\n"),
               "text:5:3: coordinate 'B' moves no mass: its body has no inertia about the axis");
    CHECK_TEXT(said(HEAD ARM "  b: {joint: {name: B, revolute: [0, 3, 4], at: a.B}, mass: 1, com: [0, 3, 4]}\n"),
               "text:5:3: coordinate 'B' moves no mass: its body has no inertia about the axis");
    CHECK_TEXT(said(HEAD "  s: {joint: {cylindrical: z, at: ground}, inertia: {zz: 1}}\n"),
               "the accelerations are not determined: the motion of 's.1' moves no mass; give body 's', or one that "
               "moves with it, a mass or an inertia");
    CHECK_TEXT(said(HEAD "  s: {joint: {prismatic: z, at: ground}, inertia: {zz: 1}}\n"),
               "text:4:3: coordinate 's' moves no mass: its body has none");
}

static void a_chain_is_named_once(void)
{
    CHECK_TEXT(said(HEAD ARM "  b: {joint: {name: B, revolute: z, at: a.B}}\n"
                             "  c: {joint: {name: C, revolute: z, at: b}}\n"),
               "text:6:3: joint 'C' moves no mass: its body has neither mass nor inertia");
}

static void these_may_be_massless(void)
{
    CHECK_TEXT(said(HEAD ARM "  b: {joint: {name: B, revolute: z, at: a.B}, points: {C: [1.2, 0, 0]}}\n"
                             "loops: {C: {ball: [ground.D, b.C]}}\nstart: {q: {A: 0.5, B: -1}}\n"),
               "");
    CHECK_TEXT(said(HEAD ARM "  b: {joint: {name: B, revolute: z, at: a.B}}\ndrives: {m: {joint: B, angle: t}}\n"), "");
    CHECK_TEXT(said(HEAD "  b: {joint: {name: B, revolute: z, at: ground}}\n"
                         "  c: {joint: {name: C, revolute: x, at: b}, mass: 1, com: [0, 1, 0]}\n"),
               "");
}

/* A rod with two balls turns about itself; a mass at the crossing of two axes turns with neither. */
static void the_reduced_mass_shows_it(void)
{
    const char *loop =
        said(HEAD ARM "  b: {joint: {name: B, motions: [R3, R2, R1], at: a.B}, points: {C: [1.2, 0, 0]}}\n"
                      "loops: {C: {ball: [ground.D, b.C]}}\nstart: {q: {A: 0.5, B.1: -1}}\n");
    CHECK(strstr(loop, "the motion of 'B.3' moves no mass; give body 'b'"));
    CHECK_TEXT(said(HEAD "  a: {joint: {name: A, revolute: z, at: ground}}\n"
                         "  b: {joint: {name: B, revolute: x, at: a}, mass: 1, inertia: {xx: 1}}\n"),
               "the accelerations are not determined: the motion of 'A' moves no mass; give body 'a', or one that "
               "moves with it, a mass or an inertia");
}

int main(void)
{
    TEST(the_tree_shows_it);
    TEST(a_chain_is_named_once);
    TEST(these_may_be_massless);
    TEST(the_reduced_mass_shows_it);
    return check_report();
}
