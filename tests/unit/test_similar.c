/* SPDX-License-Identifier: BSD-3-Clause */
/* wings: rail */
/* Wheelsets of one shape and many sizes, of one material: at poses and rates that are alike, places, semi-axes and
 * penetrations go with the size, forces with its square, creepages not at all. Models of 1:10 stand on rigs. */
#include "derived.h"
#include "dynamics/equations.h"
#include "model/data/model.h"
#include "symbolic/table_function.h"
#include "testing.h"
#include <kempe/kempe.h>
#include <math.h>

enum { Y, Z, YAW, ROLL, SPIN, COORDINATES, POSES = 80, SIDES = 2 };

static kempe_context *context;

/* -- models ------------------------------------------------------------------------------------------ */

static void put_list(kmp_text *text, int count, const double *x, double scale)
{
    for (int k = 0; k < count; k++) {
        kmp_text_put(text, k > 0 ? ", " : "[");
        kmp_text_number(text, x[k] * scale);
    }
    kmp_text_put(text, "]");
}

static void put_profile(kmp_text *text, const char *name, const kmp_table *height, double scale)
{
    kmp_text_printf(text, "  %s: {y: ", name);
    put_list(text, height->count, height->x, scale);
    kmp_text_put(text, ", z: ");
    put_list(text, height->count, height->y, scale);
    kmp_text_put(text, "}\n");
}

static kempe_model *read_model(kmp_text *text)
{
    kempe_model *model = NULL;
    if (text->failed ||
        kempe_model_read_text(context, text->s, KEMPE_ROOT "/tests/models/similar.yaml", &model) != KEMPE_OK)
        printf("%s\n", kempe_context_message(context));
    CHECK(model != NULL);
    kmp_text_free(text);
    return model;
}

/* The profiles of full size. */
static kempe_model *read_profiles(const char *wheel)
{
    kmp_text text = {0};
    kmp_text_printf(&text,
                    "kempe: 1\nprofiles:\n  wheel: {csv: ../../examples/profiles/%s.csv, y: y, z: z}\n"
                    "  head: {csv: ../../examples/profiles/uic60.csv, y: y, z: z}\n"
                    "bodies: {a: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 1}}}\n",
                    wheel);
    return read_model(&text);
}

/* speed: below any that is rolled at. */
static kempe_model *read_size(const kempe_model *full, const char *contact, double scale)
{
    kmp_text text = {0};
    kmp_text_put(&text, "kempe: 1\nprofiles:\n");
    put_profile(&text, "wheel", full->profiles[0].height, scale);
    put_profile(&text, "head", full->profiles[1].height, scale);
    kmp_text_printf(&text,
                    "parameters: {L: %.17g}\n"
                    "tracks: {line: {at: ground.O, rail: head, gauge: 1.435*L, gauge_depth: 14 mm*L, "
                    "inclination: 1/40}}\n"
                    "ground: {points: {O: [0, 0, 0]}}\n"
                    "bodies:\n"
                    "  set:\n"
                    "    joint: {name: S, motions: [T2, T3, R3, R1, R2], at: ground}\n"
                    "    mass: 1\n"
                    "    inertia: {xx: 1, yy: 1, zz: 1}\n"
                    "    points: {L: [0, 0.75*L, 0], R: [0, -0.75*L, 0]}\n"
                    "wheels:\n",
                    scale);
    for (int side = 0; side < SIDES; side++)
        kmp_text_printf(&text, "  %c: {on: line.%s, at: set.%c, profile: wheel, radius: 0.46*L, speed: 0.01*L, %s}\n",
                        side ? 'R' : 'L', side ? "right" : "left", side ? 'R' : 'L', contact);
    kmp_text_put(&text, "run: {t_end: 1, outputs: [contact(L), contact(R)]}\n");
    return read_model(&text);
}

static void same_zones(const kempe_model *a, const kempe_model *b, double scale)
{
    for (int side = 0; side < SIDES; side++) {
        const kmp_wheel *x = &a->wheels[side], *y = &b->wheels[side];
        CHECK(x->zone_count == y->zone_count && x->zone_count > 1);
        for (int k = 0; k < x->zone_count; k++)
            for (int end = 0; end < 2; end++)
                CHECK(fabs(y->zone[k][end] / scale - x->zone[k][end]) < 1e-12);
    }
}

/* -- poses ------------------------------------------------------------------------------------------- */

/* A wheelset of full size, at 20 m/s: flange and tread, some tenths of a millimetre deep. */
static state random_pose(void)
{
    state s = {0};
    s.q[Y] = between(-0.009, 0.009);
    s.q[Z] = 0.46 - between(0, 3e-4);
    s.q[YAW] = between(-0.02, 0.02);
    s.q[ROLL] = between(-0.002, 0.002);
    s.qd[Y] = between(-0.1, 0.1);
    s.qd[SPIN] = between(-2, 2);
    return s;
}

static state of_size(const state *full, double scale)
{
    state s = *full;
    for (int k = Y; k <= Z; k++) {
        s.q[k] *= scale;
        s.qd[k] *= scale;
    }
    for (int k = 0; k < SIDES; k++)
        s.lambda[k] *= scale * scale;
    return s;
}

/* Powers of the size that values of a contact go with; and how large they are at full size. */
static const int power[KMP_CONTACT_SHOWN] = {1, 1, 0, 2, 0, 0, -1, 2, 2, 3, 1, 1, 0};
static const double size[KMP_CONTACT_SHOWN] = {1e-2, 1, 0.1, 1e5, 1, 1, 1, 1e5, 1e5, 1e3, 1e-2, 1e-2, 1};

/* The largest difference of any value; `pressed` counts contacts that bear something. */
static double difference(const derived *a, const derived *b, double scale, int *pressed)
{
    double worst = 0;
    for (int i = 0; i < a->eq.outputs.shown_count; i++) {
        int k = i % KMP_CONTACT_SHOWN;
        double off = fabs(b->shown[i] / pow(scale, power[k]) - a->shown[i]) / size[k];
        worst = off <= worst ? worst : off; /* NaN stays */
        *pressed += k == 3 && a->shown[i] > 100;
    }
    for (int i = 0; i < a->m; i++)
        worst = check_max(worst, fabs(b->h[i] / scale - a->h[i]));
    return worst;
}

static void check_sizes(const kempe_model *a, const kempe_model *b, double scale, double near)
{
    derived x, y;
    bool ok = derived_init(&x, a, KMP_SET_CLOSURE | KMP_SET_OUTPUT, KMP_SCHEME_COMPOSITE, false);
    ok = ok && derived_init(&y, b, KMP_SET_CLOSURE | KMP_SET_OUTPUT, KMP_SCHEME_COMPOSITE, false);
    CHECK(ok);
    if (!ok)
        return;
    double worst = 0;
    int pressed = 0;
    random_seed(7);
    for (int k = 0; k < POSES; k++) {
        state s = random_pose();
        s.lambda[0] = s.lambda[1] = x.m > 0 ? 6e4 : 0;
        state other = of_size(&s, scale);
        derived_eval(&x, &s);
        derived_eval(&y, &other);
        double off = difference(&x, &y, scale, &pressed);
        worst = off <= worst ? worst : off;
    }
    CHECK(pressed > POSES && worst < near);
    if (!(worst < near))
        printf("size %g: %.3g, %d pressed\n", scale, worst, pressed);
    derived_free(&x);
    derived_free(&y);
}

static void similar(const char *wheel, const char *contact, double near)
{
    static const double scales[] = {0.1, 0.2, 1.0 / 3, 3};
    kempe_model *profiles = read_profiles(wheel);
    kempe_model *full = profiles ? read_size(profiles, contact, 1) : NULL;
    for (size_t k = 0; full && k < sizeof scales / sizeof *scales; k++) {
        kempe_model *m = read_size(profiles, contact, scales[k]);
        if (!m)
            continue;
        same_zones(full, m, scales[k]);
        check_sizes(full, m, scales[k], near);
        kempe_model_free(m);
    }
    kempe_model_free(full);
    kempe_model_free(profiles);
}

/* Exponents are gaps over spreads, of which rounding leaves 1e-16 * 0.46 m / 4 um; a variance of places is a 400th of
 * what it is the difference of. */
static void elastic_wheels(void)
{
    similar("s1002", "contact: elastic, creep: polach", 2e-8);
    similar("cone20", "contact: elastic, creep: polach", 2e-8);
}

static void rigid_wheels(void)
{
    similar("s1002", "contact: rigid, creep: polach", 1e-9);
}

int main(void)
{
    context = kempe_context_new();
    TEST(elastic_wheels);
    TEST(rigid_wheels);
    kempe_context_free(context);
    return check_report();
}
