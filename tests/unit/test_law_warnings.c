/* SPDX-License-Identifier: BSD-3-Clause */
/* Warnings of laws that mean less than they seem to say: friction by direction, reactions beside couplers. */
#include "base/text.h"
#include "loaded.h"
#include <kempe/check.h>
#include <string.h>

static void note(void *user, kempe_level level, const char *line)
{
    if (level == KEMPE_LOG_WARNING)
        kmp_text_printf(user, "%s\n", line);
}

/* True if check, and a run where `runs`, warn of a model with `words`; NULL: neither warns. */
static void expect(const char *text, const char *words, bool runs)
{
    loaded l = load_text(text);
    for (int k = 0; k < 2 && l.system; k++) {
        kmp_text said = {0};
        kempe_check *check = NULL;
        kempe_trajectory *run = NULL;
        kempe_context_set_log(l.context, note, &said);
        if (k == 0)
            CHECK(kempe_check_new(l.system, &check) >= KEMPE_OK);
        else
            (void)kempe_simulate(l.system, &(kempe_run_options){.t_end = 0.01}, &run);
        bool expected = words && (k == 0 || runs);
        CHECK(expected ? said.s && strstr(said.s, words) : !said.s);
        if (expected ? !said.s : said.s != NULL)
            printf("%s\n%s\n", text, said.s ? said.s : "no warning");
        kempe_check_free(check);
        kempe_trajectory_free(run);
        kmp_text_free(&said);
    }
    unload(&l);
}

#define BLOCK(friction)                                                                                                \
    "kempe: 1\ngravity: [0, 0, -9.81]\n"                                                                               \
    "bodies: {block: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"                                         \
    "forces: {rub: {joint: x, friction: {" friction "}}}\n"

static void friction_by_direction(void)
{
    static const char words[] = "friction 'rub': its level depends on the direction of motion";
    expect(BLOCK("force: 'if(qd(x) > 0, 1, 3)'"), words, true);
    expect(BLOCK("force: '2 - sign(qd(x))'"), words, true);
    expect(BLOCK("force: 1, static: 'if(0 < 2*qd(x), 1, 3)'"), words, true);
    expect(BLOCK("mu: 'if(qd(x) > 0, 0.1, 0.3)'"), words, true);
    expect(BLOCK("force: 'if(qd(x) > 0, 1, 3)', speed: 0.01"), NULL, true);
    expect(BLOCK("force: 'if(abs(qd(x)) > 0.1, 1, 3)'"), NULL, true);
    expect(BLOCK("force: 'if(t > 0.1, 1, 3)'"), NULL, true);
    expect(BLOCK("force: '1/(1 + 3*abs(qd(x)))'"), NULL, true);
}

#define GEARS(more)                                                                                                    \
    "kempe: 1\n"                                                                                                       \
    "bodies:\n"                                                                                                        \
    "  a: {joint: {revolute: z, at: ground}, mass: 1, inertia: {zz: 1}}\n"                                             \
    "  b: {joint: {revolute: z, at: ground}, mass: 1, inertia: {zz: 1}}\n"                                             \
    "  c: {joint: {revolute: z, at: ground}, mass: 1, inertia: {zz: 1}}\n"                                             \
    "loops: {mesh: {coupler: {a: 2, b: 1}}}\n" more

static void reactions_beside_couplers(void)
{
    expect(GEARS("run: {outputs: [reaction(b)]}\n"), "joint 'b' is without the load of coupler 'mesh'", true);
    expect(GEARS("run: {outputs: [moment(a)]}\n"), "joint 'a' is without the load of coupler 'mesh'", true);
    expect(GEARS("forces: {f: {joint: a, friction: {mu: 0.1, radius: 1 cm}}}\n"), "joint 'a' is without", true);
    expect(GEARS("run: {outputs: [reaction(c)]}\n"), NULL, true);
    expect(GEARS("run: {outputs: [lambda(mesh)]}\n"), NULL, true);
}

#define FLAT(gravity, slide, friction)                                                                                 \
    "kempe: 1\ngravity: " gravity "\n"                                                                                 \
    "ground: {points: {O: [0, 0, 0]}}\n"                                                                               \
    "bodies:\n"                                                                                                        \
    "  crank: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 0.01}, points: {B: [0.1, 0, 0]}}\n"   \
    "  rod: {joint: {name: B, revolute: z, at: crank.B}, mass: 1, inertia: {zz: 0.01}, points: {C: [0.3, 0, 0]}}\n"    \
    "  slider: {" slide "mass: 5, inertia: {zz: 0.1}, points: {C: [0, 0, 0]}}\n"                                       \
    "forces: {rub: {" friction "}}\n"                                                                                  \
    "start: {q: {A: 60 deg, B: -80 deg}, hold: [A]}\n"
#define SLIDE  "joint: {name: S, prismatic: x, at: ground}, "
#define CLOSED "loops: {C: {ball: [rod.C, slider.C]}}\n"
#define CUT                                                                                                            \
    "joints: {C: {revolute: [rod.C, slider.C], cut: no}, S: {prismatic: [ground.O, slider.C], axis: x, cut: yes}}\n"

/* In a plane mechanism that lies flat the weight of the slider is on its slide, where that is a joint of the tree. */
static void weight_across_a_plane(void)
{
    static const char by_slide[] =
        "joint 'S' carries the whole load across the plane of the mechanism; the share of loop 'C'",
                      by_loop[] = "lacks the load of 'S' across the plane of the mechanism";
    expect(FLAT("[0, 0, -9.81]", SLIDE, "joint: S, friction: {mu: 0.3}") CLOSED, by_slide, true);
    expect(FLAT("[0, 0, -9.81]", "", "sliding: position(slider.C).x, friction: {mu: 0.3, reaction: S}") CUT, by_loop,
           true);
    expect(FLAT("[0, -9.81, 0]", SLIDE, "joint: S, friction: {mu: 0.3}") CLOSED, NULL, true);
    expect(FLAT("[0, -9.81, 0]", "", "sliding: position(slider.C).x, friction: {mu: 0.3, reaction: S}") CUT, NULL,
           true);
    expect(FLAT("[0, 0, -9.81]", SLIDE, "joint: S, friction: {mu: 0.3}"), NULL, true);
    expect(FLAT("[0, 0, -9.81]", SLIDE, "joint: A, friction: {mu: 0.3, radius: 1 cm}") CLOSED, NULL, true);
    expect(FLAT("[0, 0, -9.81]", SLIDE, "joint: B, friction: {mu: 0.3, radius: 1 cm, reaction: C}") CLOSED, NULL, true);
}

int main(void)
{
    TEST(friction_by_direction);
    TEST(reactions_beside_couplers);
    TEST(weight_across_a_plane);
    return check_report();
}
