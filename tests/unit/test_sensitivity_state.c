/* SPDX-License-Identifier: BSD-3-Clause */
/* Derivatives of equilibria, modes and reactions as they are asked for: against two-sided differences of models that
 * are read anew with other values, with a sweep of steps; the governor's height by its speed; what is refused. */
#include "analyses/sensitivity/sensitivity_study.h"
#include "loaded.h"
#include <kempe/kempe.h>
#include <kempe/sensitivity.h>
#include <kempe/settings.h>
#include <stdbool.h>

enum { MOST = 64 };

#define FOUR_BAR                                                                                                       \
    "kempe: 1\ngravity: [0, -9.81, 0]\n"                                                                               \
    "parameters: { crank: 0.3, coupler: 0.8, rocker: 0.7, base: 0.9, k: 30, rest: 1, c: 0.4, m: 2*crank}\n"            \
    "ground: {points: {O: [0, 0, 0], D: [base, 0, 0]}}\n"                                                              \
    "bodies:\n"                                                                                                        \
    "  a: {joint: {revolute: z, at: ground.O}, mass: 1, com: [crank/2, 0, 0], inertia: {zz: crank^2/12}, "             \
    "points: {B: [crank, 0, 0]}}\n"                                                                                    \
    "  b: {joint: {revolute: z, at: a.B}, mass: m, com: [coupler/2, 0, 0], inertia: {zz: m*coupler^2/12}, "            \
    "points: {C: [coupler, 0, 0]}}\n"                                                                                  \
    "  c: {joint: {revolute: z, at: ground.D}, mass: 1, com: [rocker/2, 0, 0], inertia: {zz: 0.04}, "                  \
    "points: {C: [rocker, 0, 0]}}\n"                                                                                   \
    "loops: {C: {ball: [b.C, c.C]}}\n"                                                                                 \
    "forces: {k: {joint: a, spring: {stiffness: k, rest: rest, damping: c}}}\n"                                        \
    "start: {q: {a: 60 deg, b: -32 deg, c: 106 deg}, hold: [a], qd: {a: 3}}\n"                                         \
    "run: {outputs: [position(b.C), force(k)]}\n"

/* One row of `of` with a parameter set to a value (NULL: as it is). */
static kempe_sensitivity *ask_of(loaded *m, const char *text, const kempe_setting *set,
                                 const kempe_sensitivity_options *options)
{
    kempe_sensitivity *s = NULL;
    *m = (loaded){.context = kempe_context_new()};
    CHECK(kempe_model_read_text_set(m->context, text, "model.yaml", set, set != NULL, &m->model) == KEMPE_OK);
    if (m->model && kempe_sensitivity_new(m->model, options, &s) != KEMPE_OK)
        printf("%s\n", kempe_context_message(m->context));
    CHECK(s && s->rows == 1 && s->columns <= MOST);
    return s;
}

static void values_at(const char *text, const kempe_sensitivity_options *options, const char *name, double x,
                      double *values)
{
    char digits[32];
    loaded m;
    (void)snprintf(digits, sizeof digits, "%.17g", x);
    kempe_sensitivity *s = ask_of(&m, text, &(kempe_setting){name, digits}, options);
    for (int c = 0; s && c < s->columns; c++)
        values[c] = kmp_sensitivity_value(s, 0, c);
    kempe_sensitivity_free(s);
    unload(&m);
}

/* Every column by every parameter, beside the largest of the columns of the same kind (by the best step). */
static void against_differences(const char *text, kempe_sensitivity_options options, double within)
{
    loaded m;
    kempe_sensitivity *s = ask_of(&m, text, NULL, &options);
    double worst = 0;
    for (int k = 0; s && k < s->count; k++) {
        const char *name = s->name[k];
        int columns = s->columns;
        double best = INFINITY, size = 1e-3, x = 0;
        char key[64];
        for (int c = 0; c < columns; c++)
            size = check_max(size, fabs(kmp_sensitivity_slope(s, 0, c, k)));
        (void)snprintf(key, sizeof key, " %s: ", name);
        (void)sscanf(strstr(text, key) + strlen(key), "%lf", &x);
        for (double step = 1e-3 * x; step > 5e-6 * x; step /= 10) {
            double up[MOST], down[MOST], off = 0;
            values_at(text, &options, name, x + step, up);
            values_at(text, &options, name, x - step, down);
            for (int c = 0; c < columns; c++)
                off = check_max(off, fabs((up[c] - down[c]) / (2 * step) - kmp_sensitivity_slope(s, 0, c, k)));
            best = fmin(best, off / size);
        }
        worst = check_max(worst, best);
        CHECK(best < within);
    }
    printf("   %s at %s: off by %.1e\n", options.of, options.at ? options.at : "equilibrium", worst);
    kempe_sensitivity_free(s);
    unload(&m);
}

static void what_is_asked_of_a_four_bar(void)
{
    static const char all[] = "crank,coupler,rocker,base,k,rest,c";
    against_differences(FOUR_BAR, (kempe_sensitivity_options){.of = "equilibrium", .parameters = all}, 1e-8);
    against_differences(FOUR_BAR, (kempe_sensitivity_options){.of = "reactions", .parameters = all}, 1e-8);
    against_differences(FOUR_BAR, (kempe_sensitivity_options){.of = "modes", .parameters = all}, 1e-8);
    against_differences(FOUR_BAR, (kempe_sensitivity_options){.of = "reactions", .parameters = all, .at = "start"},
                        1e-8);
    against_differences(FOUR_BAR, (kempe_sensitivity_options){.of = "modes", .parameters = all, .at = "start"}, 1e-8);
    against_differences(
        FOUR_BAR,
        (kempe_sensitivity_options){.of = "reactions",
                                    .parameters = all,
                                    .at = "start",
                                    .outputs = "acceleration(b.C).y,energy.potential,qdd(c),velocity(b.C)"},
        1e-8);
}

/* The crank under a filter and a controller with an integral, a sampled trim, the relay's and the counter's start
 * values, and a delayed load: all of them at rest. */
static void what_states_do(void)
{
    static const char all[] = "crank,base,rest,goal,gain,lag,trim,late,on,begun,k";
    against_differences(
        "kempe: 1\ngravity: [0, -9.81, 0]\n"
        "parameters: { crank: 0.3, base: 0.9, rest: 1, k: 30, goal: 1.3, gain: 12, lag: 0.2, trim: 3, late: 0.3, on: "
        "2, begun: 0.4}\n"
        "states:\n"
        "  seen: {rate: (q(a) - seen)/lag}\n"
        "  sum: {rate: gain*(goal - seen)}\n"
        "  held: {sample: 10 ms, next: trim*cos(q(b)) + 0.1*held}\n"
        "  relay: {hysteresis: q(c), limits: [9, 10], values: [on, 7]}\n"
        "  count: {start: begun^2, when: q(a) > 5, next: count + 1}\n"
        "  load: {delay: held*q(c)^2, time: late}\n"
        "ground: {points: {O: [0, 0, 0], D: [base, 0, 0]}}\n"
        "bodies:\n"
        "  a: {joint: {revolute: z, at: ground.O}, mass: 1, com: [crank/2, 0, 0], points: {B: [crank, 0, 0]}}\n"
        "  b: {joint: {revolute: z, at: a.B}, mass: 2, com: [0.4, 0, 0], inertia: {zz: 0.1}, points: {C: [0.8, 0, "
        "0]}}\n"
        "  c: {joint: {revolute: z, at: ground.D}, mass: 1, com: [0.35, 0, 0], inertia: {zz: 0.04}, points: {C: [0.7, "
        "0, 0]}}\n"
        "loops: {C: {ball: [b.C, c.C]}}\n"
        "forces:\n"
        "  k: {joint: a, spring: {stiffness: k, rest: rest}}\n"
        "  motor: {joint: a, torque: 3*sum - 0.7*load - count - 4*qd(a)}\n"
        "  more: {joint: c, torque: relay + held}\n"
        "start: {q: {a: 60 deg, b: -32 deg, c: 106 deg}, hold: [a]}\n"
        "run: {outputs: [reaction(C)]}\n",
        (kempe_sensitivity_options){.of = "equilibrium", .parameters = all}, 1e-8);
}

/* An arm of two links on the floor and a slide at its stop; one of the contacts is open. */
static void contacts_that_press(void)
{
    static const char arm[] =
        "kempe: 1\ngravity: [0, -9.81, 0]\n"
        "parameters: { m: 1.3, k: 4, l: 0.5, h: 0.1, r: 0.2, to: 0.33, rest: 0.2}\n"
        "ground: {points: {O: [0, 0, 0], G: [0, -h, 0], H: [0, -3, 0]}}\n"
        "bodies:\n"
        "  arm: {joint: {name: A, revolute: z, at: ground.O}, mass: m, com: [l/2, 0, 0], points: {P: [l, 0, 0]}}\n"
        "  link: {joint: {name: B, revolute: z, at: arm.P}, mass: 0.4, com: [r/2, 0, 0], points: {Q: [r, 0, 0]}}\n"
        "  slide: {joint: {name: s, prismatic: x, at: ground.O}, mass: 1}\n"
        "contacts:\n"
        "  floor: {point: link.Q, on: {plane: ground.G, normal: y}, restitution: 0.2}\n"
        "  below: {point: link.Q, on: {plane: ground.H, normal: y}, restitution: 0.2}\n"
        "  stop: {joint: s, upper: to, restitution: 0.1}\n"
        "forces:\n"
        "  a: {joint: A, torque: -k*(q(A) - rest) - qd(A)}\n"
        "  b: {joint: B, torque: -2*q(B) - 0.1*qd(B)}\n"
        "  s: {joint: s, force: 5 - k*q(s) - qd(s)}\n"
        "start: {q: {A: -5 deg, B: -5 deg, s: 0.2}}\n";
    static const char all[] = "m,k,l,h,r,to,rest", outputs[] = "q,force(floor),force(below),force(stop)";
    const double k = 4, to = 0.33;
    loaded m;
    against_differences(arm, (kempe_sensitivity_options){.of = "equilibrium", .parameters = all, .outputs = outputs},
                        1e-8);
    against_differences(arm, (kempe_sensitivity_options){.of = "reactions", .parameters = all, .outputs = outputs},
                        1e-8);
    kempe_sensitivity *s =
        ask_of(&m, arm, NULL,
               &(kempe_sensitivity_options){.of = "equilibrium", .parameters = "k,to", .outputs = "q(s),force(stop)"});
    CHECK_NEAR(s ? kmp_sensitivity_value(s, 0, 1) : NAN, 5 - k * to, 1e-13);
    CHECK_NEAR(s ? kmp_sensitivity_slope(s, 0, 0, 0) : NAN, 0, 1e-14);
    CHECK_NEAR(s ? kmp_sensitivity_slope(s, 0, 0, 1) : NAN, 1, 1e-14);
    CHECK_NEAR(s ? kmp_sensitivity_slope(s, 0, 1, 0) : NAN, -to, 1e-13);
    CHECK_NEAR(s ? kmp_sensitivity_slope(s, 0, 1, 1) : NAN, -k, 1e-13);
    kempe_sensitivity_free(s);
    unload(&m);
}

/* x = (y + z)/(k - a), where y and z keep their start values and a x is delayed; c y' = b x - c g at rest. */
static void rest_of_states(void)
{
    static const char text[] = "kempe: 1\nparameters: {k: 10, y0: 3, T: 0.2, a: 0.7, b: 4, g: 0.1}\n"
                               "states:\n"
                               "  y: {start: y0, when: q(x) > 2, next: 9}\n"
                               "  z: {start: 2, when: q(x) > 3, next: 9}\n"
                               "  d: {delay: a*q(x), time: T}\n"
                               "  i: {rate: b*q(x) - g*i}\n"
                               "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
                               "forces: {f: {joint: x, force: y + z + d - k*q(x) - 0.5*qd(x)}}\n";
    static const char *const names[] = {"k", "y0", "T", "a", "b", "g"};
    const double k = 10, a = 0.7, b = 4, g = 0.1, x = 5 / (k - a);
    const double by[] = {-x / (k - a), 1 / (k - a), 0, x / (k - a), 0, 0};
    loaded m;
    kempe_sensitivity *s = ask_of(&m, text, NULL, &(kempe_sensitivity_options){.of = "equilibrium"});
    CHECK(s && s->columns == 5 && s->count == 6);
    for (int p = 0; s && p < s->count; p++) {
        const double own = strcmp(names[p], "b") == 0 ? x / g : strcmp(names[p], "g") == 0 ? -b * x / (g * g) : 0;
        CHECK_TEXT(s->name[p], names[p]);
        CHECK_NEAR(kmp_sensitivity_slope(s, 0, 0, p), by[p], 1e-14);
        CHECK_NEAR(kmp_sensitivity_slope(s, 0, 1, p), p == 1, 1e-14);
        CHECK_NEAR(kmp_sensitivity_slope(s, 0, 2, p), 0, 1e-14);
        CHECK_NEAR(kmp_sensitivity_slope(s, 0, 3, p), a * by[p] + (p == 3 ? x : 0), 1e-14);
        CHECK_NEAR(kmp_sensitivity_slope(s, 0, 4, p), b / g * by[p] + own, 1e-13);
    }
    kempe_sensitivity_free(s);
    unload(&m);
    s = ask_of(&m, text, NULL,
               &(kempe_sensitivity_options){.of = "reactions", .outputs = "q", .parameters = "state.z"});
    CHECK_NEAR(s ? kmp_sensitivity_slope(s, 0, 0, 0) : NAN, 1 / (k - a), 1e-14);
    kempe_sensitivity_free(s);
    unload(&m);
}

static void refuse(const char *text, kempe_sensitivity_options options, kempe_status status, const char *word)
{
    loaded m = {.context = kempe_context_new()};
    kempe_sensitivity *s = NULL;
    CHECK(kempe_model_read_text(m.context, text, "model.yaml", &m.model) == KEMPE_OK);
    CHECK(kempe_sensitivity_new(m.model, &options, &s) == status && s == NULL);
    CHECK(strstr(kempe_context_message(m.context), word));
    if (!strstr(kempe_context_message(m.context), word))
        printf("%s\n", kempe_context_message(m.context));
    unload(&m);
}

static void what_is_refused(void)
{
    static const char tree[] = "kempe: 1\nparameters: {m: 1}\ngravity: [0, -1, 0]\n"
                               "bodies: {a: {joint: {revolute: z, at: ground}, mass: m, com: [0, -1, 0]}}\n";
    refuse(FOUR_BAR, (kempe_sensitivity_options){.of = "equilibrium", .at = "start"}, KEMPE_E_ARGUMENT,
           "not an equilibrium");
    refuse(FOUR_BAR, (kempe_sensitivity_options){.of = "modes", .at = "end"}, KEMPE_E_ARGUMENT, "'end'");
    refuse(FOUR_BAR, (kempe_sensitivity_options){.of = "modes", .outputs = "q"}, KEMPE_E_ARGUMENT, "eigenvalues");
    refuse(FOUR_BAR, (kempe_sensitivity_options){.of = "modes", .integral = 1}, KEMPE_E_ARGUMENT, "integral");
    refuse(FOUR_BAR, (kempe_sensitivity_options){.of = "reactions", .parameters = "n"}, KEMPE_E_ARGUMENT, "'n'");
    refuse(tree, (kempe_sensitivity_options){.of = "reactions"}, KEMPE_E_FAILED, "no closures");
    static const char relay[] = "kempe: 1\nparameters: {k: 10}\n"
                                "states: {y: {start: 2, hysteresis: q(x), limits: [0.1, 0.15], values: [2, 4]}}\n"
                                "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
                                "forces: {f: {joint: x, force: y - k*q(x)}}\n";
    refuse(relay, (kempe_sensitivity_options){.of = "equilibrium"}, KEMPE_E_FAILED, "its input requires 4 there");
    static const char contact[] = "kempe: 1\nparameters: {k: 10}\n"
                                  "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n"
                                  "contacts: {stop: {joint: x, upper: 1, restitution: 0}}\n"
                                  "forces: {f: {joint: x, force: k - 10*q(x)}}\n";
    refuse(contact, (kempe_sensitivity_options){.of = "equilibrium"}, KEMPE_E_FAILED, "'stop' just touches");
    refuse(contact, (kempe_sensitivity_options){.of = "reactions", .outputs = "q", .at = "start"}, KEMPE_E_ARGUMENT,
           "'stop' opens");
    refuse(relay, (kempe_sensitivity_options){.of = "reactions", .at = "start"}, KEMPE_E_ARGUMENT,
           "'y' changes at events");
}

/* Texts beside the numbers. */
static void notes(void)
{
    static const char model[] =
        "kempe: 1\nparameters: {k: 4, c: 4}\ngravity: [0, 0, 0]\n"
        "bodies:\n"
        "  a: {joint: {prismatic: x, at: ground}, mass: 1}\n"
        "  b: {joint: {prismatic: y, at: ground}, mass: 1}\n"
        "  c: {joint: {prismatic: y, at: ground}, mass: 1}\n"
        "  d: {joint: {prismatic: y, at: ground}, mass: 1}\n"
        "forces: {a: {joint: a, spring: {stiffness: k, damping: c}}, b: {joint: b, spring: {stiffness: 9}}, "
        "c: {joint: c, spring: {stiffness: 9}}}\n";
    loaded m;
    char *text = NULL;
    kempe_sensitivity *s = ask_of(&m, model, NULL, &(kempe_sensitivity_options){.of = "modes"});
    CHECK(kempe_sensitivity_print(s, KEMPE_TEXT, &text) == KEMPE_OK && strstr(text, "note      2 eigenvalues"));
    kempe_text_free(text);
    CHECK(kempe_sensitivity_print(s, KEMPE_JSON, &text) == KEMPE_OK && strstr(text, "\"note\": \"2 eigenvalues"));
    /* rounding says whether a double root without a second vector is two real modes or one of a pair */
    bool pair = NULL != strstr(text, "of modes 1, equal to others with fewer vectors, no derivatives exist");
    CHECK(pair || strstr(text, "of modes 1, 2, equal to others with fewer vectors, no derivatives exist"));
    CHECK(strstr(text, pair ? "2 eigenvalues are exactly zero and omitted; of modes 2, 3, equal to others, the "
                              "derivatives of all of them are given, sorted by size; "
                            : "2 eigenvalues are exactly zero and omitted; of modes 3, 4, equal to others, the "
                              "derivatives of all of them are given, sorted by size; "));
    kempe_text_free(text);
    CHECK(isnan(kmp_sensitivity_slope(s, 0, 0, 0)) && kmp_sensitivity_slope(s, 0, pair ? 8 : 6, 0) == 0);
    kempe_sensitivity_free(s);
    unload(&m);
}

int main(void)
{
    TEST(what_is_asked_of_a_four_bar);
    TEST(what_states_do);
    TEST(rest_of_states);
    TEST(contacts_that_press);
    TEST(what_is_refused);
    TEST(notes);
    return check_report();
}
