/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: slow once 6 */
/* `check` as a doctor and the assembly modes, against plane trigonometry and what is known of the classical
 * overconstrained linkages. */
#include "constraints/closing/assembly_modes.h"
#include "constraints/diagnosis/diagnosis.h"
#include "loaded.h"
#include "random_model.h"
#include "testing.h"
#include <kempe/check.h>
#include <stdlib.h>

typedef struct patient {
    kempe_context *context;
    kempe_model *model;
    kempe_system *system;
    kempe_check *check;
} patient;

static const double pi = 3.14159265358979323846;

static patient examined(loaded l, kempe_status expected)
{
    patient p = {l.context, l.model, l.system, NULL};
    CHECK(l.system && kempe_check_new(l.system, &p.check) == expected);
    if (!p.check) {
        printf("%s\n", kempe_context_message(l.context));
        exit(1);
    }
    return p;
}

static patient admit(const char *path)
{
    return examined(load(path), KEMPE_OK);
}

static patient admit_text(const char *text, kempe_status expected)
{
    return examined(load_text(text), expected);
}

static void dismiss(patient *p)
{
    loaded l = {p->context, p->model, p->system};
    kempe_check_free(p->check);
    unload(&l);
}

/* The text says this. */
static void says(const patient *p, const char *words)
{
    char *text = NULL;
    CHECK(kempe_check_print(p->check, KEMPE_FULL_TEXT, &text) == KEMPE_OK);
    if (!check_says(text, words))
        printf("not said: %s\nin:\n%s", words, text);
    CHECK(check_says(text, words));
    kempe_text_free(text);
}

/* A four-bar: ground, crank, coupler, rocker; its loops and start. */
static const char *four_bar(double g, double a, double b, double c, const char *loops, const char *start)
{
    static char text[4096];
    snprintf(text, sizeof text,
             "kempe: 1\nname: bars\n"
             "ground: {points: {O: [0, 0, 0], D: [%.17g, 0, 0]}}\n"
             "bodies:\n"
             "  a: {joint: {name: A, revolute: z, at: ground.O}, mass: 1, com: [0.1, 0, 0], inertia: {zz: 0.01}, "
             "points: {B: [%.17g, 0, 0]}}\n"
             "  b: {joint: {name: B, revolute: z, at: a.B}, mass: 1, com: [0.1, 0, 0], inertia: {zz: 0.05}, "
             "points: {C: [%.17g, 0, 0], X: [%.17g, 0, 1]}}\n"
             "  c: {joint: {name: D, revolute: z, at: ground.D}, mass: 1, com: [0.1, 0, 0], inertia: {zz: 0.01}, "
             "points: {C: [%.17g, 0, 0], X: [%.17g, 0, 1]}}\n"
             "loops: {%s}\nstart: {%s}\n",
             g, a, b, b, c, c, loops, start);
    return text;
}

static const char *const one_loop = "C: {ball: [b.C, c.C]}";

/* -- redundancy -------------------------------------------------------------------------------------- */

static void healthy_mechanisms(void)
{
    static const char *const paths[] = {"examples/four_bar/four_bar.yaml", "examples/andrews/andrews.yaml",
                                        "examples/slider_crank/slider_crank.yaml", "tests/models/fourbar2.yaml"};
    for (int k = 0; k < 4; k++) {
        patient p = admit(paths[k]);
        const kmp_diagnosis *d = &p.check->diagnosis;
        CHECK(p.check->part.p == 1 && d->ran && d->moved && d->generic_rank == p.system->m);
        CHECK(d->set_count == 0 && d->shared_count == 0 && d->repair_count == 0);
        CHECK(d->second == KMP_SECOND_UNTRIED && d->limits.walked && d->limits.cycle);
        dismiss(&p);
    }
}

/* Every set dependent wherever the mechanism moves; which rows may go is tried. */
static void always_redundant(const char *path, int redundant, int may_lose)
{
    patient p = admit(path);
    const kmp_diagnosis *d = &p.check->diagnosis;
    CHECK(p.check->part.p == 1 && p.system->m - p.check->part.r == redundant);
    CHECK(d->moved && d->generic_rank == p.check->part.r && d->set_count == redundant);
    for (int k = 0; k < d->set_count; k++)
        CHECK(d->sets[k].always && d->sets[k].count >= 2);
    CHECK(d->shared_count == 6 && d->repair_count == 2);
    for (int k = 0; k < d->repair_count; k++)
        CHECK(d->repairs[k].count == may_lose && d->repairs[k].of == 3);
    CHECK(d->second == KMP_SECOND_UNTRIED);
    says(&p, "in every position");
    says(&p, "reactions not unique");
    dismiss(&p);
}

static void overconstrained_linkages(void)
{
    always_redundant("tests/models/bricard_balls.yaml", 2, 2);
    always_redundant("tests/models/bennett_balls.yaml", 4, 3);
}

static void same_rows(const patient *p, const kmp_dependent *set, const char *one, const char *two)
{
    CHECK(set->always && set->count == 2);
    CHECK_TEXT(p->system->row_names[set->rows[0]], one);
    CHECK_TEXT(p->system->row_names[set->rows[1]], two);
}

static void a_doubled_closure_is_named(void)
{
    patient p = admit_text(four_bar(1, 0.3, 0.9, 0.7, "C: {ball: [b.C, c.C]}, Twin: {ball: [b.C, c.C]}",
                                    "q: {A: 90 deg, B: -60 deg, D: 120 deg}, hold: [A]"),
                           KEMPE_OK);
    const kmp_diagnosis *d = &p.check->diagnosis;
    CHECK(d->set_count == 2 && d->repair_count == 2);
    same_rows(&p, &d->sets[0], "C.1", "Twin.1");
    same_rows(&p, &d->sets[1], "C.2", "Twin.2");
    says(&p, "remove ball 'C': the other closures imply it");
    says(&p, "remove ball 'Twin': the other closures imply it");
    dismiss(&p);
}

/* A hinge as two balls on its axis: the second one says the same in the plane. */
static void a_planar_loop_with_spatial_closures(void)
{
    patient p = admit_text(four_bar(1, 0.3, 0.9, 0.7, "C: {ball: [b.C, c.C]}, X: {ball: [b.X, c.X]}",
                                    "q: {A: 90 deg, B: -60 deg, D: 120 deg}, hold: [A]"),
                           KEMPE_OK);
    const kmp_diagnosis *d = &p.check->diagnosis;
    CHECK(p.check->part.p == 1 && p.system->m == 4 && d->declared == 6 && d->set_count == 2);
    says(&p, "4 equations in 2 closures (C, X), 2 of them independent");
    says(&p, "3 - 4 = -1 by counting: 2 equations are redundant in every position");
    dismiss(&p);
}

/* Cut hinges in a plane that is oblique to all axes: the rows of their axes are nothing but rounding. */
static void rows_of_rounding_hold_nothing(void)
{
    static const char *const paths[] = {"examples/slider_crank_spatial/slider_crank_spatial.yaml",
                                        "examples/n_four_bar_spatial/n_four_bar_spatial.yaml",
                                        "examples/parallel_robot/parallel_robot_spatial.yaml"};
    static const int redundant[] = {3, 6, 16};
    for (int k = 0; k < 3; k++) {
        patient p = admit(paths[k]);
        const kmp_diagnosis *d = &p.check->diagnosis;
        CHECK(p.system->m - p.check->part.r == redundant[k] && d->set_count == redundant[k]);
        for (int i = 0; i < d->set_count; i++)
            CHECK(d->sets[i].always);
        CHECK(d->second == KMP_SECOND_UNTRIED);
        says(&p, "constrains nothing: always");
        dismiss(&p);
    }
}

/* -- only here --------------------------------------------------------------------------------------- */

static void a_parallelogram_flat_and_upright(void)
{
    patient p = admit_text(four_bar(0.8, 0.3, 0.8, 0.3, one_loop, "q: {A: 0}"), KEMPE_OK);
    const kmp_diagnosis *d = &p.check->diagnosis;
    CHECK(p.check->part.p == 2 && d->moved && d->generic_rank == 2 && d->margin == 0);
    CHECK(d->set_count == 1 && !d->sets[0].always && d->repair_count == 0);
    CHECK(d->second == KMP_SECOND_BRANCHES && d->branches == 2 && !d->limits.walked);
    says(&p, "only in this position");
    says(&p, "elsewhere the mechanism has 1 degree of freedom");
    dismiss(&p);
    p = admit("tests/models/parallelogram.yaml");
    d = &p.check->diagnosis;
    CHECK(p.check->part.p == 1 && d->set_count == 0 && d->second == KMP_SECOND_UNTRIED);
    int change_points = 0;
    for (int k = 0; k < d->limits.limit_position_count; k++) {
        const kmp_limit_position *mark = &d->limits.limit_position[k];
        if (mark->coordinate >= 0)
            continue;
        change_points++;
        CHECK(mark->margin == 0 && fabs(sin(mark->q[0])) < 1e-6);
    }
    CHECK(change_points == 2 && d->limits.cycle && d->limits.range[0].turns == 1);
    dismiss(&p);
}

/* Bars that just reach: a structure that gives a little. */
static void stretched_bars_are_shaky(void)
{
    patient p = admit_text(four_bar(1.5, 0.5, 0.4, 0.6, one_loop, "q: {A: 0, B: 0, D: 180 deg}"), KEMPE_OK);
    const kmp_diagnosis *d = &p.check->diagnosis;
    CHECK(p.check->part.p == 2 && !d->moved && d->second == KMP_SECOND_NONE);
    says(&p, "infinitesimally mobile");
    dismiss(&p);
    p = admit_text(four_bar(1.5, 0.5, 0.4, 0.6, one_loop, "q: {A: 0.1, B: 0.1, D: 3}"), KEMPE_OK);
    CHECK(!p.check->diagnosis.moved && p.check->diagnosis.second == KMP_SECOND_NONE);
    dismiss(&p);
}

/* -- limits of motion -------------------------------------------------------------------------------- */

/* The angle at the first of two sides, opposite the third. */
static double cosine_law(double one, double two, double opposite)
{
    return acos((one * one + two * two - opposite * opposite) / (2 * one * two));
}

static void swings(const kmp_diagnosis *d, int k, double low, double high)
{
    const kmp_coordinate_range *s = &d->limits.range[k];
    CHECK(d->limits.walked && s->moves && s->turns == 0 && s->low_dead && s->high_dead);
    CHECK_NEAR(s->low, low, 1e-10);
    CHECK_NEAR(s->high, high, 1e-10);
}

static void triple_rocker_swings(void)
{
    patient p = admit("tests/models/triple_rocker.yaml");
    const kmp_diagnosis *d = &p.check->diagnosis;
    double a = cosine_law(1.2, 0.8, 0.5 + 0.7), c = cosine_law(1.2, 0.7, 0.8 + 0.5);
    CHECK(d->limits.cycle);
    swings(d, 0, -a, a);
    swings(d, 2, pi - c, pi + c);
    dismiss(&p);
}

static void crank_rocker(double g, double a, double b, double c)
{
    patient p =
        admit_text(four_bar(g, a, b, c, one_loop, "q: {A: 90 deg, B: -60 deg, D: 120 deg}, hold: [A]"), KEMPE_OK);
    const kmp_diagnosis *d = &p.check->diagnosis;
    CHECK(d->limits.cycle && abs(d->limits.range[0].turns) == 1);
    swings(d, 2, pi - cosine_law(g, c, b + a), pi - cosine_law(g, c, b - a));
    says(&p, "A  rotates fully");
    dismiss(&p);
}

/* A rotates fully, D oscillates between where crank and coupler are in line. */
static void crank_rockers_swing(void)
{
    crank_rocker(1, 0.3, 0.9, 0.7);
    crank_rocker(1, 0.05, 0.6, 0.8);
    crank_rocker(1000, 300, 900, 700); /* in millimetres */
}

static void slider_crank_dead_centres(void)
{
    patient p = admit("examples/slider_crank/slider_crank.yaml");
    const kmp_diagnosis *d = &p.check->diagnosis;
    int dead = 0;
    swings(d, 2, -0.4, 0); /* crank 0.2; zero at the outer dead centre */
    for (int k = 0; k < d->limits.limit_position_count; k++)
        dead += d->limits.limit_position[k].coordinate == 2 && fabs(sin(d->limits.limit_position[k].q[0])) < 1e-10;
    CHECK(dead == 2 && d->limits.limit_position_count >= 2);
    CHECK(d->alternatives[2].max_b > 1e3 && d->alternatives[0].max_b < 1e3);
    says(&p, "cannot be independent slider");
    dismiss(&p);
}

/* -- what does not assemble -------------------------------------------------------------------------- */

static void lengths_that_never_meet(void)
{
    patient p = admit_text(four_bar(2.4, 0.3, 0.8, 0.3, one_loop, "q: {A: 1, B: -1, D: 2}"), KEMPE_E_FAILED);
    const kmp_obstacle *o = &p.check->obstacle;
    CHECK(!p.check->assembled && o->reach_count == 1 && o->release_count == 0);
    CHECK_NEAR(o->reaches[0].longest, 2.4, 1e-14);
    CHECK_NEAR(o->reaches[0].others, 1.4, 1e-14);
    CHECK_NEAR(p.check->assembly->gap, 1.0, 1e-6);
    says(&p, "body 'ground' spans 2.4 m from O to D, the other links at most 1.4 m: 1 m are missing");
    dismiss(&p);
}

/* The tip of the crank held at 150 degrees is 1.87 m from D: too far for 0.8 + 0.3. */
static void held_where_it_cannot_close(void)
{
    patient p =
        admit_text(four_bar(1.3, 0.3, 0.8, 0.4, one_loop, "q: {A: 150 deg, B: -1, D: 2}, hold: [A]"), KEMPE_E_FAILED);
    const kmp_obstacle *o = &p.check->obstacle;
    CHECK(o->reach_count == 0 && o->release_count == 1 && o->releases[0].closes);
    CHECK(p.check->reason[0] != '\0');
    CHECK_TEXT(kempe_context_message(p.context), p.check->reason); /* whatever was tried since */
    says(&p, "it closes if 'A' is released");
    dismiss(&p);
    p = admit_text(four_bar(1.3, 0.3, 0.8, 0.4, one_loop, "q: {A: 150 deg, B: 2, D: 2}, hold: [A, B, D]"),
                   KEMPE_E_FAILED);
    CHECK(p.check->obstacle.release_count == 4 && p.check->obstacle.releases[3].coordinate == -1);
    CHECK(p.check->obstacle.releases[3].closes);
    char *text = NULL;
    CHECK(kempe_check_print(p.check, KEMPE_JSON, &text) == KEMPE_OK);
    CHECK(text && strstr(text, "\"status\": \"failed\"") && strstr(text, "\"dof\": null"));
    kempe_text_free(text);
    dismiss(&p);
}

/* -- random mechanisms ------------------------------------------------------------------------------- */

/* Each limit that was found is closed, within the ranges, and there the coordinate's rate is zero: J without its column
 * has a rank less by one. */
static void look_at_landmarks(const patient *p, int *dead_centres)
{
    const kmp_diagnosis *d = &p->check->diagnosis;
    kmp_walk *w = kmp_walk_new(p->system);
    int n = p->system->n, m = p->system->m;
    for (int i = 0; i < d->limits.limit_position_count; i++) {
        const kmp_limit_position *mark = &d->limits.limit_position[i];
        kmp_walk_evaluate(w, mark->q);
        for (int r = 0; r < m; r++)
            CHECK(fabs(w->h[r]) < 1e-10);
        for (int k = 0; k < n; k++)
            CHECK(mark->q[k] >= d->limits.range[k].low - 1e-9 && mark->q[k] <= d->limits.range[k].high + 1e-9);
        if (mark->coordinate < 0)
            continue;
        ++*dead_centres;
        CHECK(kmp_walk_tangents(w, n - 1) == n - 1 || d->generic_rank < n - 1);
        CHECK(fabs(w->basis[mark->coordinate]) < 1e-6);
    }
    kmp_walk_free(w);
}

static void random_mechanisms_are_examined(void)
{
    enum { TRIALS = 300 };
    int assembled = 0, walked = 0, cycles = 0, dead = 0;
    for (int trial = 0; trial < TRIALS; trial++) {
        random_model r = random_model_new((uint64_t)trial + 1, 2 + trial % 4, MODEL_LOOPS | MODEL_PLAIN);
        patient p = {.context = r.context, .model = r.model};
        if (kempe_system_new(p.model, &p.system) != KEMPE_OK) { /* a closure that no coordinate moves */
            random_model_free(&r);
            continue;
        }
        kempe_status status = kempe_check_new(p.system, &p.check);
        CHECK(status == KEMPE_OK || status == KEMPE_E_FAILED);
        char *text = NULL;
        CHECK(!p.check || kempe_check_print(p.check, trial % 2 ? KEMPE_FULL_TEXT : KEMPE_JSON, &text) == KEMPE_OK);
        kempe_text_free(text);
        if (p.check && p.check->assembled) {
            assembled++;
            walked += p.check->diagnosis.limits.walked;
            cycles += p.check->diagnosis.limits.cycle;
            look_at_landmarks(&p, &dead);
        }
        kempe_check_free(p.check);
        kempe_system_free(p.system);
        random_model_free(&r);
    }
    printf("  %d random mechanisms: %d assembled, %d walked, %d cycles, %d dead centres\n", TRIALS, assembled, walked,
           cycles, dead);
    CHECK(assembled > TRIALS / 5 && walked > 0 && dead > 0);
}

/* Hinges of a closed four-bar with these sides (ground, crank, coupler, rocker) that turn fully by Grashof: between
 * ground and crank, crank and coupler, rocker and ground. */
static void grashof(const double side[4], bool turns[3])
{
    int shortest = 0, longest = 0;
    double sum = 0;
    for (int k = 0; k < 4; k++) {
        shortest = side[k] < side[shortest] ? k : shortest;
        longest = side[k] > side[longest] ? k : longest;
        sum += side[k];
    }
    bool rule = side[shortest] + side[longest] < sum / 2;
    turns[0] = rule && (shortest == 0 || shortest == 1);
    turns[1] = rule && (shortest == 1 || shortest == 2);
    turns[2] = rule && (shortest == 3 || shortest == 0);
}

/* Both bounds of a bar are where the two others are in line, stretched or folded. */
static void bounds_by_cosine_law(const kmp_coordinate_range *range, double own, double ground, double two, double three,
                                 bool rocker)
{
    const double bound[2] = {range->low, range->high};
    for (int k = 0; k < 2; k++) {
        double opposite = sqrt(own * own + ground * ground - (rocker ? -2 : 2) * own * ground * cos(bound[k]));
        CHECK(fmin(fabs(opposite - (two + three)), fabs(opposite - fabs(two - three))) < 1e-9);
    }
}

static void random_four_bars_obey_grashof(void)
{
    enum { TRIALS = 400 };
    int full = 0, near = 0;
    random_seed(4);
    for (int trial = 0; trial < TRIALS; trial++) {
        double a = between(0.2, 1), b = between(0.2, 1), g = between(0.2, 1), qa = between(-pi, pi);
        double qb = between(-pi, pi), x = a * cos(qa) + b * cos(qa + qb) - g, y = a * sin(qa) + b * sin(qa + qb);
        double side[4] = {g, a, b, hypot(x, y)};
        char start[160];
        snprintf(start, sizeof start, "q: {A: %.17g, B: %.17g, D: %.17g}, hold: [A]", qa, qb, atan2(y, x));
        patient p = admit_text(four_bar(side[0], side[1], side[2], side[3], one_loop, start), KEMPE_OK);
        const kmp_limits *l = &p.check->diagnosis.limits;
        bool turns[3], marked = l->limit_position_count == KMP_MOST_LIMIT_POSITIONS;
        for (int k = 0; k < l->limit_position_count; k++)
            marked = marked || l->limit_position[k].coordinate < 0;
        grashof(side, turns);
        CHECK(l->walked && l->cycle);
        for (int k = 0; k < 3; k++)
            CHECK((l->range[k].turns != 0) == turns[k] && abs(l->range[k].turns) <= 1);
        if (!turns[0])
            bounds_by_cosine_law(&l->range[0], side[1], side[0], side[2], side[3], false);
        if (!turns[2])
            bounds_by_cosine_law(&l->range[2], side[3], side[0], side[1], side[2], true);
        full += turns[0] || turns[1] || turns[2];
        near += marked;
        dismiss(&p);
    }
    printf("  %d random four-bars: %d by Grashof, %d near a change point\n", TRIALS, full, near);
}

/* -- assembly modes ---------------------------------------------------------------------------------- */

static int branches_of(const patient *p, int seed, char *text, size_t size)
{
    kempe_branches *b = NULL;
    char *printed = NULL;
    CHECK(kempe_branches_new(p->system, seed, &b) == KEMPE_OK);
    int count = b ? kempe_branches_count(b) : -1;
    for (int k = 0; k < count; k++) {
        CHECK(b->branch[k].residual < 1e-11);
        for (int i = 0; i < p->system->n; i++)
            CHECK(!b->kept[i] || b->branch[k].q[i] == p->check->assembly->q[i]);
        for (int i = 0; i < k; i++)
            CHECK(memcmp(b->branch[i].q, b->branch[k].q, (size_t)p->system->n * sizeof(double)) != 0);
    }
    CHECK(b && kempe_branches_print(b, KEMPE_TEXT, &printed) == KEMPE_OK);
    if (text)
        snprintf(text, size, "%s", printed);
    kempe_text_free(printed);
    kempe_branches_free(b);
    return count;
}

static void two_modes_of_a_dyad(void)
{
    char one[2048], two[2048];
    patient p = admit("examples/four_bar/four_bar.yaml");
    CHECK(branches_of(&p, 1, one, sizeof one) == 2 && branches_of(&p, 1, two, sizeof two) == 2);
    CHECK_TEXT(one, two);
    CHECK(branches_of(&p, 77, NULL, 0) == 2);
    CHECK(strstr(one, "branch 1 (of the model)") && strstr(one, "hold: [crank]"));
    dismiss(&p);
    p = admit("examples/slider_crank/slider_crank.yaml");
    CHECK(branches_of(&p, 1, NULL, 0) == 2);
    dismiss(&p);
}

/* The points at which circles about two points meet: 0 or 2. */
static int circles(const double a[2], double ra, const double b[2], double rb, double out[2][2])
{
    double dx = b[0] - a[0], dy = b[1] - a[1], d = hypot(dx, dy), x = (ra * ra - rb * rb + d * d) / (2 * d);
    double y = ra * ra - x * x;
    if (y <= 0)
        return 0;
    for (int k = 0; k < 2; k++) {
        double side = k ? -sqrt(y) : sqrt(y);
        out[k][0] = a[0] + (x * dx - side * dy) / d;
        out[k][1] = a[1] + (x * dy + side * dx) / d;
    }
    return 2;
}

/* Three dyads: the point E from the crank's tip (0.028) and B (0.035), then two dyads of 0.02 and 0.04 from E to A. */
static void the_modes_of_andrews_are_those_of_its_dyads(void)
{
    patient p = admit("examples/andrews/andrews.yaml");
    double beta = p.check->assembly->q[0], tip[2] = {0.007 * cos(beta), 0.007 * sin(beta)};
    const double a[2] = {-0.06934, -0.00227}, b[2] = {-0.03635, 0.03273};
    double e[2][2], other[2][2];
    int expected = 0, found = circles(tip, 0.028, b, 0.035, e);
    for (int k = 0; k < found; k++)
        expected += circles(e[k], 0.02, a, 0.04, other) * circles(e[k], 0.02, a, 0.04, other);
    int count = branches_of(&p, 1, NULL, 0);
    printf("  Andrews: %d modes, %d by its dyads\n", count, expected);
    CHECK(count == expected && expected >= 4);
    dismiss(&p);
}

/* A platform on three legs of two bars, the first bars held at the angles A. */
static const char *platform(const double angle[3], double leg)
{
    static const char *const legs[] = {"1", "2", "3"};
    static char text[4096];
    int at = snprintf(text, sizeof text,
                      "kempe: 1\nname: platform\n"
                      "ground: {points: {P1: [0, 0, 0], P2: [1, 0, 0], P3: [0.5, 0.9, 0]}}\nbodies:\n");
    for (int k = 0; k < 3; k++) {
        at +=
            snprintf(text + at, sizeof text - (size_t)at,
                     "  a%s: {joint: {name: A%s, revolute: z, at: ground.P%s}, mass: 1, inertia: {zz: 1}, points: {E: "
                     "[0.4, 0, 0]}}\n"
                     "  b%s: {joint: {name: B%s, revolute: z, at: a%s.E}, mass: 1, inertia: {zz: 1}, points: {E: "
                     "[%.17g, 0, 0]}}\n",
                     legs[k], legs[k], legs[k], legs[k], legs[k], legs[k], leg);
    }
    snprintf(text + at, sizeof text - (size_t)at,
             "  p: {joint: {name: P, revolute: z, at: b1.E}, mass: 1, inertia: {zz: 1}, points: {Q2: [0.5, 0, 0], Q3: "
             "[0.2, 0.4, 0]}}\n"
             "loops: {L2: {ball: [b2.E, p.Q2]}, L3: {ball: [b3.E, p.Q3]}}\n"
             "start: {q: {A1: %.17g, B1: 1, P: -0.7, A2: %.17g, B2: 1, A3: %.17g, B3: 1}, hold: [A1, A2, A3]}\n",
             angle[0], angle[1], angle[2]);
    return text;
}

/* By how much Q3 misses the third leg when the first one's second bar points along `way`; NAN when the four-bar of the
 * first two legs does not close. */
static double miss(const double a[3], double leg, double way, int side)
{
    double e[3][2] = {{0.4 * cos(a[0]), 0.4 * sin(a[0])},
                      {1 + 0.4 * cos(a[1]), 0.4 * sin(a[1])},
                      {0.5 + 0.4 * cos(a[2]), 0.9 + 0.4 * sin(a[2])}};
    double q1[2] = {e[0][0] + leg * cos(way), e[0][1] + leg * sin(way)}, q2[2][2];
    if (!circles(q1, 0.5, e[1], leg, q2))
        return NAN;
    double c = (q2[side][0] - q1[0]) / 0.5, s = (q2[side][1] - q1[1]) / 0.5;
    double q3[2] = {q1[0] + 0.2 * c - 0.4 * s, q1[1] + 0.2 * s + 0.4 * c};
    return hypot(q3[0] - e[2][0], q3[1] - e[2][1]) - leg;
}

static void modes_of_platform(const double a[3], double leg, int least)
{
    enum { STEPS = 20000 };
    int expected = 0;
    for (int side = 0; side < 2; side++)
        for (int k = 0; k < STEPS; k++)
            expected += miss(a, leg, 2 * pi * k / STEPS, side) * miss(a, leg, 2 * pi * (k + 1) / STEPS, side) < 0;
    patient p = admit_text(platform(a, leg), KEMPE_OK);
    int count = branches_of(&p, 1, NULL, 0);
    printf("  platform: %d modes, %d by scanning\n", count, expected);
    CHECK(count == expected && count >= least && count <= 6);
    dismiss(&p);
}

static void the_modes_of_a_platform_on_three_legs(void)
{
    modes_of_platform((const double[]){1.9, 1.2, 3.6}, 0.5, 2);
    modes_of_platform((const double[]){0.84, 5.32, 4.8}, 0.7, 4);
    modes_of_platform((const double[]){4.56, 3.31, 4.8}, 0.7, 6);
}

/* A motor behind a gear turns many times in a cycle: the search counts its turns, and ends at none of them. */
static void a_fast_motor_ends_no_search(void)
{
    static const struct {
        double ratio, crank;
        int turns, cycles; /* of the motor and the crank; 0: they oscillate */
    } cases[] = {{5, 0.3, 5, 1},       {50, 0.3, 50, 1},     {-500, 0.3, -500, 1},
                 {5000, 0.3, 5000, 1}, {50.25, 0.3, 201, 4}, {500, 0.8, 0, 0}};
    for (int k = 0; k < (int)(sizeof cases / sizeof *cases); k++) {
        static char text[1024];
        (void)snprintf(
            text, sizeof text,
            "kempe: 1\n"
            "ground: {points: {O: [0, 0, 0], P: [1, 0, 0], M: [0, -1, 0]}}\n"
            "bodies:\n"
            "  crank: {joint: {name: A, revolute: z, at: ground.O}, mass: 1, inertia: {zz: 0.01}, points: {B: "
            "[%g, 0, 0]}}\n"
            "  rod: {joint: {name: B, revolute: z, at: crank.B}, mass: 1, inertia: {zz: 0.01}, points: {C: "
            "[%g, 0, 0]}}\n"
            "  rocker: {joint: {name: D, revolute: z, at: ground.P}, mass: 1, inertia: {zz: 0.01}, points: {C: "
            "[0.7, 0, 0]}}\n"
            "  motor: {joint: {name: M, revolute: z, at: ground.M}, mass: 1, inertia: {zz: 0.001}}\n"
            "loops: {C: {ball: [rod.C, rocker.C]}, g: {constraint: 'q(M) - %g*(q(A) - 1)'}}\n"
            "start: {q: {A: 1, B: -0.7, D: 1.8}, hold: [A]}\n",
            cases[k].crank, cases[k].crank < 0.5 ? 0.9 : 0.4, cases[k].ratio);
        patient p = admit_text(text, KEMPE_OK);
        const kmp_limits *l = &p.check->diagnosis.limits;
        const kmp_coordinate_range *crank = &l->range[0], *motor = &l->range[3];
        CHECK(l->walked && l->cycle && !l->ended);
        CHECK(abs(motor->turns) == abs(cases[k].turns) && abs(crank->turns) == cases[k].cycles);
        CHECK(l->range[2].low_dead && l->range[2].high_dead);
        if (cases[k].turns == 0) {
            CHECK(motor->low_dead && motor->high_dead);
            CHECK_NEAR(motor->high - motor->low, cases[k].ratio * (crank->high - crank->low), 1e-6);
        }
        dismiss(&p);
    }
}

int main(void)
{
    TEST(healthy_mechanisms);
    TEST(overconstrained_linkages);
    TEST(a_doubled_closure_is_named);
    TEST(a_planar_loop_with_spatial_closures);
    TEST(rows_of_rounding_hold_nothing);
    TEST(a_parallelogram_flat_and_upright);
    TEST(stretched_bars_are_shaky);
    TEST(triple_rocker_swings);
    TEST(crank_rockers_swing);
    TEST(slider_crank_dead_centres);
    TEST(lengths_that_never_meet);
    TEST(held_where_it_cannot_close);
    TEST(random_mechanisms_are_examined);
    TEST(random_four_bars_obey_grashof);
    TEST(two_modes_of_a_dyad);
    TEST(the_modes_of_andrews_are_those_of_its_dyads);
    TEST(the_modes_of_a_platform_on_three_legs);
    TEST(a_fast_motor_ends_no_search);
    return check_report();
}
