/* SPDX-License-Identifier: BSD-3-Clause */
/* Cams: laws of motion, eccentric discs with each follower, forces, lift-off; closed forms, and digits by mpmath. */
#include "compared_runs.h"
#include "model/data/cam.h"
#include "model/data/model.h"
#include "model/data/outline.h"
#include "random.h"
#include "sensitivity_of.h"
#include "ways.h"
#include <kempe/ensemble.h>
#include <kempe/equilibrium.h>
#include <kempe/kinematics.h>
#include <kempe/modes.h>
#include <kempe/table.h>
#include <math.h>

static const double pi = 3.14159265358979323846;

/* The disc of radius R about a centre at the distance E from the shaft, and the roller. */
static const double R = 0.03, E = 0.01, ROLLER = 0.008;

static double number_of(const kempe_trajectory *run, const char *output, bool last)
{
    kempe_table *table = NULL;
    CHECK(run && kempe_trajectory_outputs(run, output, &table) == KEMPE_OK);
    const double x = table ? kempe_table_number(table, last ? kempe_table_row_count(table) - 1 : 0, 1) : NAN;
    kempe_table_free(table);
    return x;
}

/* -- laws ------------------------------------------------------------------------------------------------ */

static const struct {
    kmp_cam_law_kind law;
    double at[3], rate, acceleration; /* at 0.3; the largest ones */
} laws[] = {
    {KMP_CAM_HARMONIC, {.206107373853763, 1.27080092307881, 2.90060395646061}, 1.5707963267949, 4.93480220054468},
    {KMP_CAM_CYCLOIDAL, {.148634654271869, 1.30901699437495, 5.97566432948311}, 2, 6.28318530717959},
    {KMP_CAM_POLYNOMIAL_345, {.16308, 1.323, 5.04}, 1.875, 5.77350269189626},
    {KMP_CAM_POLYNOMIAL_4567, {.126036, 1.29654, 7.4088}, 2.1875, 7.51318840439929},
    {KMP_CAM_MODIFIED_SINE, {.177887762628721, 1.3229542069342, 4.10807269243602}, 1.75960338595377, 5.52795707054409},
    {KMP_CAM_MODIFIED_TRAPEZOID, {.160590348672676, 1.24440618814066, 4.88812376281326}, 2, 4.88812376281326}};

enum { LAWS = sizeof laws / sizeof *laws };

/* C1: values and derivatives of the laws, their largest rates and accelerations. */
static void laws_have_their_digits(void)
{
    for (int k = 0; k < LAWS; k++) {
        double most[2] = {0};
        for (int d = 0; d < 3; d++)
            CHECK_NEAR(kmp_cam_law_value(laws[k].law, d, 0.3), laws[k].at[d], 2e-14);
        for (int i = 0; i <= 40000; i++)
            for (int d = 0; d < 2; d++)
                most[d] = fmax(most[d], kmp_cam_law_value(laws[k].law, d + 1, i / 40000.0));
        CHECK_NEAR(most[0], laws[k].rate, 1e-8);
        CHECK_NEAR(most[1], laws[k].acceleration, 1e-7);
        CHECK_NEAR(kmp_cam_law_value(laws[k].law, 0, 0), 0, 1e-15);
        CHECK_NEAR(kmp_cam_law_value(laws[k].law, 0, 1), 1, 1e-15);
    }
}

/* Each derivative is the slope of the one before it; lift and rate have no jumps, of most laws the acceleration too. */
static void laws_are_smooth(void)
{
    for (int k = 0; k < LAWS; k++)
        for (int i = 1; i < 1000; i++)
            for (int d = 0; d < 3; d++) {
                const double x = i / 1000.0 + 3e-4, h = 1e-5;
                const double before = kmp_cam_law_value(laws[k].law, d, x - h);
                const double after = kmp_cam_law_value(laws[k].law, d, x + h);
                CHECK_NEAR(kmp_cam_law_value(laws[k].law, d + 1, x), (after - before) / (2 * h), 3e-6);
                const double edge = i / 1000.0, low = kmp_cam_law_value(laws[k].law, d, edge - 1e-9);
                CHECK_NEAR(kmp_cam_law_value(laws[k].law, d, edge), low, 1e-6);
            }
}

/* A law in a model: the lift, its rate and its acceleration are those of the law, at angles all round. */
#define LAW                                                                                                            \
    "kempe: 1\noutlines:\n"                                                                                            \
    "  disc: {law: [{to: 60 deg, rise: 10 mm, by: %s}, {to: 180 deg}, {to: 260 deg, rise: -10 mm, by: "                \
    "polynomial_345}, {to: 360 deg}], base: %s, follower: {%s}}\n"                                                     \
    "bodies:\n"                                                                                                        \
    "  shaft: {joint: {name: turn, revolute: z, at: ground}, mass: 1, inertia: {zz: 0.001}, points: {C: [0, 0, 0]}}\n" \
    "  valve: {joint: {name: lift, prismatic: x, at: ground}, mass: 0.5, points: {foot: [0, 0, 0]}}\n"                 \
    "loops: {cam: {follower: valve.foot, %s, on: {outline: disc, at: shaft.C}}}\n"                                     \
    "drives: {motor: {joint: turn, angle: \"%.17g + 20*t\"}}\nstart: {q: {lift: 45 mm}}\n"                             \
    "run: {output_step: 0.001}\n"

static const struct {
    const char *base, *law, *loop;
} followers[] = {{"32 mm", "roller: 8 mm", "roller: 8 mm"},
                 {"40 mm", "knife: yes", "knife: yes"},
                 {"40 mm", "flat: yes", "flat: x"}};

static void a_model_has_the_law(void)
{
    for (int k = 0; k < LAWS; k++)
        for (int f = 0; f < 2; f++)
            for (int i = 0; i < 12; i++) {
                char model[2048];
                const double angle = -0.2 + 0.5 * i + 0.07 * k;
                (void)snprintf(model, sizeof model, LAW, kmp_cam_law_words[laws[k].law], followers[f].base,
                               followers[f].law, followers[f].loop, angle);
                loaded l = load_text(model);
                kempe_trajectory *run = simulate(&l, &ways[(i + k) % 7], 0.001);
                const double width[2] = {pi / 3, 80 * pi / 180};
                const double turned = angle < 0 ? angle + 2 * pi : angle;
                const double x[2] = {turned / width[0], (turned - pi) / width[1]};
                for (int d = 0; d < 3; d++) {
                    const double up = kmp_cam_law_value(laws[k].law, d, x[0]) / pow(width[0], d);
                    const double down = kmp_cam_law_value(KMP_CAM_POLYNOMIAL_345, d, x[1]) / pow(width[1], d);
                    const char *const words[] = {"q(lift)", "qd(lift)", "qdd(lift)"};
                    CHECK_NEAR(number_of(run, words[d], false), (d == 0 ? 0.04 : 0) + 0.01 * (up - down) * pow(20, d),
                               1e-12 * pow(20, d));
                }
                kempe_trajectory_free(run);
                unload(&l);
            }
}

/* C5: pressure angle, curvature of the path of the roller and the largest pressure angle. */
static void a_law_has_its_pressure_angle(void)
{
    char model[2048];
    (void)snprintf(model, sizeof model, LAW, "cycloidal", "32 mm", "roller: 8 mm", "roller: 8 mm", pi / 9);
    loaded l = load_text(model);
    kempe_trajectory *run = simulate(&l, &ways[3], 0.001);
    CHECK_NEAR(number_of(run, "q(lift)", false), 0.04 + 0.00195501109477885, 1e-16);
    CHECK_NEAR(number_of(run, "qd(lift)", false), 20 * 0.0143239448782706, 1e-14);
    CHECK_NEAR(number_of(run, "qdd(lift)", false), 19.8478402351845, 1e-12);
    CHECK_NEAR(number_of(run, "pressure_angle(cam)", false), 0.329003661755199, 1e-14);
    CHECK_NEAR(1 / number_of(run, "curvature(cam)", false) + 0.008, 0.981401613298435, 1e-12);
    kempe_trajectory_free(run);
    unload(&l);
    double most = 0;
    for (int i = 0; i <= 40; i++) { /* the largest one of the digits is of a list of angles: 60/1000 deg apart */
        (void)snprintf(model, sizeof model, LAW, "cycloidal", "32 mm", "roller: 8 mm", "roller: 8 mm",
                       pi / 3 * (440 + i) / 1000);
        l = load_text(model);
        run = simulate(&l, &ways[3], 1e-9);
        most = fmax(most, number_of(run, "pressure_angle(cam)", false));
        kempe_trajectory_free(run);
        unload(&l);
    }
    CHECK_NEAR(most, 0.40318608966062, 1e-13);
}

/* The law's followers beside the centre line and on levers: lift, rate, acceleration, normal force and torque of the
 * motor are those of the law, as loops and in contacts. */
static const struct {
    const char *follower, *turns, *joint, *foot, *wanted;
    double base, rise, sign; /* of the lift, of the coordinate */
} beside[] = {
    {"roller: 8 mm, offset: 12 mm", "10 mm", "prismatic: x, at: ground.F", "0, 0, 0", "roller: 8 mm", 0, 0.01, 1},
    {"knife: yes, offset: -9 mm", "10 mm", "prismatic: x, at: ground.B", "0, 0, 0", "knife: yes", 0, 0.01, 1},
    {"roller: 8 mm, arm: 60 mm, distance: 80 mm", "12 deg", "revolute: z, at: ground.P", "-60 mm, 0, 0", "roller: 8 mm",
     0, 12 * 3.14159265358979323846 / 180, -1},
    {"knife: yes, arm: -60 mm, distance: 80 mm", "12 deg", "revolute: z, at: ground.P", "-60 mm, 0, 0", "knife: yes", 0,
     12 * 3.14159265358979323846 / 180, 1}};

static void followers_beside_the_centre_have_the_law(void)
{
    for (int k = 0; k < 4; k++)
        for (int i = 0; i < 14; i++) {
            char model[2048];
            const bool lever = k > 1, roller = k % 2 == 0, touches = i % 2;
            const double angle = -0.2 + 0.45 * i, radius = roller ? 0.044 : 0.036, offset = k == 0 ? 0.012 : -0.009;
            const double base = lever ? acos((0.08 * 0.08 + 0.06 * 0.06 - radius * radius) / (2 * 0.08 * 0.06))
                                      : sqrt(radius * radius - offset * offset);
            const double turned = angle < 0 ? angle + 2 * pi : angle, width[2] = {pi / 3, 80 * pi / 180};
            double lift[3], rate[3];
            for (int d = 0; d < 3; d++) {
                const double up = kmp_cam_law_value(KMP_CAM_CYCLOIDAL, d, turned / width[0]) / pow(width[0], d);
                const double down =
                    kmp_cam_law_value(KMP_CAM_POLYNOMIAL_345, d, (turned - pi) / width[1]) / pow(width[1], d);
                lift[d] = (d == 0 ? base : 0) + beside[k].rise * (up - down);
                rate[d] = beside[k].sign * lift[d] * pow(20, d);
            }
            char loop[256];
            (void)snprintf(loop, sizeof loop,
                           touches ? "contacts: {cam: {%s, on: {outline: disc, at: shaft.C}, restitution: 0}}"
                                   : "loops: {cam: {follower: valve.foot, %s, on: {outline: disc, at: shaft.C}}}",
                           !touches ? beside[k].wanted
                           : roller ? "cylinder: valve.foot, radius: 8 mm"
                                    : "point: valve.foot");
            (void)snprintf(
                model, sizeof model,
                "kempe: 1\nground: {points: {F: [0, -12 mm, 0], B: [0, 9 mm, 0], P: [80 mm, 0, 0]}}\n"
                "outlines: {disc: {law: [{to: 60 deg, rise: %s, by: cycloidal}, {to: 180 deg}, {to: 260 deg, rise: "
                "-%s, by: polynomial_345}, {to: 360 deg}], base: 36 mm, follower: {%s}}}\nbodies:\n"
                "  shaft: {joint: {name: turn, revolute: z, at: ground}, mass: 1, inertia: {zz: 0.001}, points: {C: "
                "[0, 0, 0]}}\n"
                "  valve: {joint: {name: lift, %s}, mass: 0.5, inertia: {zz: 0.002}, points: {foot: [%s]}}\n"
                "drives: {motor: {joint: turn, angle: \"%.17g + 20*t\"}}\nforces: {spring: {joint: lift, %s: %g}}\n"
                "start: {q: {lift: %.17g}, qd: {lift: %.17g}}\n%s\nrun: {output_step: 0.001}\n",
                beside[k].turns, beside[k].turns, beside[k].follower, beside[k].joint, beside[k].foot, angle,
                lever ? "torque" : "force", -100 * beside[k].sign, rate[0], rate[1], loop);
            loaded l = load_text(model);
            kempe_trajectory *run = simulate(&l, &ways[(i + k) % 5], 0.001);
            CHECK_NEAR(number_of(run, "q(lift)", false), rate[0], 1e-12);
            CHECK_NEAR(number_of(run, "qd(lift)", false), rate[1], 1e-10);
            CHECK_NEAR(number_of(run, "qdd(lift)", false), rate[2], 1e-8);
            const double push = (lever ? 0.002 : 0.5) * lift[2] * 400 + 100; /* along the lift */
            CHECK_NEAR(fabs(number_of(run, "lambda(motor)", false)), fabs(push * lift[1]), 1e-8);
            if (!lever) {
                const double tangent = (lift[1] - offset) / lift[0];
                CHECK_NEAR(fabs(number_of(run, "pressure_angle(cam)", false)), fabs(atan(tangent)), 1e-11);
                CHECK_NEAR(number_of(run, "force(cam)", false), push * sqrt(1 + tangent * tangent), 1e-8);
            }
            kempe_trajectory_free(run);
            unload(&l);
        }
}

/* The curvature of their profile is that of a path that is found on the curve of the law. */
static void profiles_beside_the_centre_are_right(void)
{
    static const char *const follower[] = {"roller: 8 mm, offset: 12 mm", "roller: 8 mm, arm: 90 mm, distance: 80 mm"};
    for (int k = 0; k < 2; k++) {
        double curvature[2], lift[2];
        for (int f = 0; f < 2; f++) {
            char model[2048];
            const double radius = f ? 0.0080001 : 0.008;
            (void)snprintf(
                model, sizeof model,
                "kempe: 1\noutlines: {disc: {law: [{to: 90 deg, rise: %s, by: cycloidal}, {to: 270 deg, rise: "
                "-%s, by: modified_sine}, {to: 360 deg}], base: 50 mm, follower: {%s}}}\nbodies:\n"
                "  shaft: {joint: {name: turn, revolute: z, at: ground}, mass: 1, inertia: {zz: 0.001}, "
                "points: {C: [0, 0, 0]}}\n"
                "  valve: {joint: {name: lift, prismatic: x, at: ground}, mass: 0.5, points: {foot: [0, 0, "
                "0]}}\n"
                "loops: {cam: {follower: valve.foot, roller: %.17g, on: {outline: disc, at: shaft.C}}}\n"
                "drives: {motor: {joint: turn, angle: 1.1}}\nstart: {q: {lift: 62 mm}}\n",
                k ? "6 deg" : "6 mm", k ? "6 deg" : "6 mm", follower[k], radius);
            loaded l = load_text(model);
            kempe_trajectory *run = simulate(&l, &ways[3], 0.001);
            const double pressure = number_of(run, "pressure_angle(cam)", false);
            curvature[f] = 1 / number_of(run, "curvature(cam)", false);
            lift[f] = number_of(run, "q(lift)", false) - (radius - 0.008) / cos(pressure);
            kempe_trajectory_free(run);
            unload(&l);
        }
        CHECK_NEAR(lift[1], lift[0], 1e-12);
        CHECK_NEAR(curvature[1], curvature[0], 1e-6 * fabs(curvature[0]));
    }
}

/* The least radius of a hollow profile: of the curvature (p^2 + 2 s'^2 - p s'')/(p^2 + s'^2)^1.5 of the path. */
static void a_hollow_profile_is_found(void)
{
    for (int k = 0; k < 2; k++) {
        char model[2048];
        double least = 0;
        kmp_cam_check place;
        (void)snprintf(model, sizeof model, LAW, "cycloidal", k ? "32 mm" : "100 mm", "roller: 8 mm", "roller: 8 mm",
                       0.0);
        loaded l = load_text(model);
        const kmp_cam *cam = l.model ? l.model->outlines[0].cam : NULL;
        for (int i = 0; cam && i < 100000; i++) {
            const double angle = 2 * pi * i / 100000, p = cam->base + kmp_cam_lift(cam, 0, angle);
            const double slope = kmp_cam_lift(cam, 1, angle), bend = kmp_cam_lift(cam, 2, angle);
            const double of_path = (p * p + 2 * slope * slope - p * bend) / pow(p * p + slope * slope, 1.5);
            least = fmin(least, of_path / (1 - 0.008 * of_path));
        }
        CHECK(cam && kmp_cam_is_hollow(cam, &place) == (k == 1) && (least < 0) == (k == 1));
        CHECK_NEAR(cam ? place.curvature : NAN, least, 1e-4);
        unload(&l);
    }
}

/* Other followers on the profile of a law: the law's own roller on the profile of a knife or a face, and back, gives
 * the curvature that the profile has. */
static void other_followers_share_the_profile(void)
{
    double curvature[3];
    for (int f = 0; f < 3; f++) {
        /* of the profile that a roller of 8 mm made */
        static const char *const loop[] = {"roller: 8.001 mm", "knife: yes", "roller: 4 mm"};
        char model[2048];
        (void)snprintf(model, sizeof model, LAW, "cycloidal", "32 mm", "roller: 8 mm", loop[f], 0.0);
        loaded l = load_text(model);
        kempe_trajectory *run = simulate(&l, &ways[3], 0.001);
        curvature[f] = number_of(run, "curvature(cam)", false);
        static const double radius[] = {0.008001, 0, 0.004};
        CHECK_NEAR(number_of(run, "q(lift)", false), 0.032 + radius[f], 1e-15);
        kempe_trajectory_free(run);
        unload(&l);
    }
    for (int f = 1; f < 3; f++)
        CHECK_NEAR(curvature[f], curvature[0], 1e-12 * curvature[0]);
}

/* -- an eccentric disc ------------------------------------------------------------------------------------- */

#define MACHINE                                                                                                        \
    "kempe: 1\ngravity: [0, -9.81, 0]\nparameters: {w: 100, stiffness: 4000}\n%s"                                      \
    "ground: {points: {O: [0, 0, 0], G: [%s, 0, 0]}}\nbodies:\n"                                                       \
    "  shaft: {joint: {name: turn, revolute: z, at: ground.O}, mass: 1, inertia: {zz: 0.001}, points: {C: [0, 0, "     \
    "0]}}\n"                                                                                                           \
    "  valve: {joint: {name: lift, prismatic: y, at: ground.G}, mass: 0.5, points: {foot: [0, 0, 0]}}\n"               \
    "forces: {spring: {joint: lift, force: \"-60 - stiffness*(q(lift) - 0.038)\"}}\n"                                  \
    "drives: {motor: {joint: turn, angle: \"40 deg + w*t\"}}\n%s\nstart: {q: {lift: %.17g}, qd: {lift: %.17g}}\n"      \
    "run: {output_step: 0.001}\n"
#define DISC "outlines: {disc: {circle: 30 mm, at: [10 mm, 0]}}\n"

static const struct {
    const char *offset, *follower, *contact;
    double lift, slope, pressure;
} discs[] = {{"0", "flat: y", "flat: valve.foot, normal: y", 0.0364278760968654, 0.00766044443118978, 0},
             {"0", "roller: 8 mm", "cylinder: valve.foot, radius: 8 mm", 0.0436477308939579, 0.00898340466085883,
              0.202981633722893},
             {"4 mm", "roller: 8 mm", "cylinder: valve.foot, radius: 8 mm", 0.0442511645124193, 0.00828251840330568,
              0.0964770807249601},
             {"0", "knife: yes", "point: valve.foot", 0.0354333512889158, 0.00935806832200974, 0.258207770910255}};

enum { DISCS = sizeof discs / sizeof *discs };

/* The disc as a table of its polar radius, and as places on it. */
static void write_disc(char *text, size_t size, bool polar)
{
    enum { PLACES = 240 };
    size_t at = 0;
    const double turn = 2 * pi / PLACES;
    at += (size_t)snprintf(text, size, polar ? "tables: {r: {periodic: yes, x: [" : "outlines: {disc: {points: [");
    for (int k = 0; k < PLACES + polar; k++)
        at += polar ? (size_t)snprintf(text + at, size - at, "%.17g, ", k * turn)
                    : (size_t)snprintf(text + at, size - at, "[%.17g, %.17g], ", E + R * cos(k * turn),
                                       R * sin(k * turn));
    if (polar) {
        at += (size_t)snprintf(text + at, size - at, "], y: [");
        for (int k = 0; k <= PLACES; k++) {
            const double a = (k % PLACES) * turn;
            at += (size_t)snprintf(text + at, size - at, "%.17g, ", E * cos(a) + sqrt(R * R - E * E * sin(a) * sin(a)));
        }
        (void)snprintf(text + at, size - at, "]}}\noutlines: {disc: {polar: r}}\n");
    } else {
        (void)snprintf(text + at, size - at, "]}}\n");
    }
}

/* C2: lift, rate and pressure angle of each follower; splines through the same disc differ by their fourth power. */
static void followers_lift(void)
{
    static char outline[3][32768], model[40000];
    (void)snprintf(outline[0], sizeof outline[0], DISC);
    write_disc(outline[1], sizeof outline[1], true);
    write_disc(outline[2], sizeof outline[2], false);
    for (int o = 0; o < 3; o++)
        for (int k = 0; k < DISCS; k++)
            for (int touches = 0; touches < 2; touches++) {
                char loop[256];
                const double near = o == 0 ? 1 : 1e5;
                (void)snprintf(loop, sizeof loop,
                               touches ? "contacts: {cam: {%s, on: {outline: disc, at: shaft.C}, restitution: 0}}"
                                       : "loops: {cam: {follower: valve.foot, %s, on: {outline: disc, at: shaft.C}}}",
                               touches ? discs[k].contact : discs[k].follower);
                (void)snprintf(model, sizeof model, MACHINE, outline[o], discs[k].offset, loop, discs[k].lift,
                               100 * discs[k].slope);
                loaded l = load_text(model);
                kempe_trajectory *run = simulate(&l, &ways[3 + (k + o) % 2], 0.001);
                CHECK_NEAR(number_of(run, "q(lift)", false), discs[k].lift, 1e-14 * near);
                CHECK_NEAR(number_of(run, "qd(lift)", false), 100 * discs[k].slope, 2e-11 * near);
                /* of the slope: by the third power of the distance of the places, 2.6 % of the radius */
                CHECK_NEAR(number_of(run, "pressure_angle(cam)", false), discs[k].pressure, o == 0 ? 1e-13 : 3e-7);
                CHECK_NEAR(number_of(run, "curvature(cam)", false), 1 / R, o == 0 ? 1e-11 : 0.02);
                kempe_trajectory_free(run);
                unload(&l);
            }
}

/* The distance of the centre of a roller over its angle, with two derivatives, and that angle: from the place u of a
 * polar spline. */
static double roller_path(const kmp_table *polar, double u, double radius, double path[3])
{
    double r[3];
    for (int d = 0; d < 3; d++)
        r[d] = kmp_table_value(polar, d, u);
    const double size = hypot(r[0], r[1]), n[2] = {r[0] / size, -r[1] / size};
    const double k = (r[0] * r[0] + 2 * r[1] * r[1] - r[0] * r[2]) / (size * size * size);
    const double p[2] = {r[0] + radius * n[0], radius * n[1]}; /* along u and across */
    const double e[2] = {p[0] / hypot(p[0], p[1]), p[1] / hypot(p[0], p[1])};
    const double along = n[0] * e[0] + n[1] * e[1], across = n[1] * e[0] - n[0] * e[1];
    path[0] = hypot(p[0], p[1]);
    path[1] = -path[0] * across / along;
    path[2] = (path[0] * path[0] + 2 * path[1] * path[1] -
               k / (1 + radius * k) * pow(path[0] * path[0] + path[1] * path[1], 1.5)) /
              path[0];
    return u + atan2(p[1], p[0]);
}

/* A roller of this radius on the polar profile of a text, pushed along x, at an angle. */
static loaded rolled(char *model, size_t size, const char *profile, double radius, double angle, double lift)
{
    (void)snprintf(model, size,
                   "kempe: 1\n%sbodies:\n"
                   "  shaft: {joint: {name: turn, revolute: z, at: ground}, mass: 1, inertia: {zz: 0.001}, "
                   "points: {C: [0, 0, 0]}}\n"
                   "  valve: {joint: {name: lift, prismatic: x, at: ground}, mass: 0.5, points: {foot: [0, 0, 0]}}\n"
                   "loops: {cam: {follower: valve.foot, roller: %.17g, on: {outline: disc, at: shaft.C}}}\n"
                   "drives: {motor: {joint: turn, angle: \"%.17g + 100*t\"}}\nstart: {q: {lift: %.17g}}\n",
                   profile, radius, angle, lift);
    return load_text(model);
}

/* Beside the places of a coarse profile, where the acceleration of the roller has a kink, and between them. */
static void a_path_is_exact(void)
{
    enum { PLACES = 9 };
    static const double x[PLACES] = {0, 0.6, 1.5, 2, 2.9, 3.7, 4.4, 5.3, 2 * 3.14159265358979323846};
    static const double y[PLACES] = {0.03, 0.031, 0.034, 0.037, 0.038, 0.036, 0.033, 0.031, 0.03};
    kmp_table *polar = kmp_table_new(KMP_TABLE_PERIODIC, PLACES, x, y);
    char table[512] = "tables: {r: {periodic: yes, x: [", model[2048];
    for (int k = 0; k < 2 * PLACES; k++) {
        const size_t at = strlen(table);
        (void)snprintf(table + at, sizeof table - at, "%s%.17g",
                       k == PLACES ? "], y: ["
                       : k         ? ", "
                                   : "",
                       k < PLACES ? x[k] : y[k - PLACES]);
    }
    (void)strcat(table, "]}}\noutlines: {disc: {polar: r}}\n");
    for (int k = 1; k < PLACES - 1; k++) {
        for (int i = -1; i <= 2; i++) {
            double path[3];
            const double angle = roller_path(polar, i < 2 ? x[k] + 1e-7 * i : (x[k] + x[k + 1]) / 2, ROLLER, path);
            loaded l = rolled(model, sizeof model, table, ROLLER, -angle, path[0]);
            kempe_trajectory *run = simulate(&l, &ways[3 + k % 2], 1e-4);
            CHECK_NEAR(number_of(run, "q(lift)", false), path[0], 1e-15);
            CHECK_NEAR(number_of(run, "qd(lift)", false), -100 * path[1], 1e-12);
            CHECK_NEAR(number_of(run, "qdd(lift)", false), 1e4 * path[2], 3e-8);
            kempe_trajectory_free(run);
            unload(&l);
        }
    }
    kmp_table_free(polar);
}

enum { MOST_PLACES = 2048 };

/* The text of a polar profile with these radii at equal angles, the last of them being the first. */
static void write_polar(char *text, size_t size, int places, double *x, double *y)
{
    size_t at = (size_t)snprintf(text, size, "tables: {r: {periodic: yes, x: [");
    y[places - 1] = y[0];
    for (int k = 0; k < 2 * places; k++) {
        if (k < places)
            x[k] = 2 * pi * k / (places - 1);
        at += (size_t)snprintf(text + at, size - at, "%s%.17g",
                               k == places ? "], y: ["
                               : k         ? ", "
                                           : "",
                               k < places ? x[k] : y[k - places]);
    }
    (void)snprintf(text + at, size - at, "]}}\noutlines: {disc: {polar: r}}\n");
}

/* Random profiles: lift, rate and acceleration by the place on the spline, whose roller is at an angle of its own. */
static void random_profiles_are_found(void)
{
    enum { PROFILES = 100, PLACES = 91, WAVES = 5 };
    static char text[8192], model[10000];
    random_seed(31);
    for (int i = 0; i < PROFILES; i++) {
        double x[PLACES], y[PLACES], size[WAVES], phase[WAVES], path[3];
        const double radius = between(0.001, 0.015), u = between(0.05, 6.2);
        for (int w = 0; w < WAVES; w++) {
            size[w] = between(0, 0.003) / ((w + 1) * (w + 1));
            phase[w] = between(0, 2 * pi);
        }
        for (int k = 0; k < PLACES; k++) {
            y[k] = 0.04;
            for (int w = 0; w < WAVES; w++)
                y[k] += size[w] * cos((w + 1) * 2 * pi * k / (PLACES - 1) + phase[w]);
        }
        write_polar(text, sizeof text, PLACES, x, y);
        kmp_table *polar = kmp_table_new(KMP_TABLE_PERIODIC, PLACES, x, y);
        const double angle = roller_path(polar, u, radius, path);
        loaded l = rolled(model, sizeof model, text, radius, -angle, path[0]);
        kempe_trajectory *run = simulate(&l, &ways[3 + i % 2], 1e-4);
        CHECK_NEAR(number_of(run, "q(lift)", false), path[0], 1e-15);
        CHECK_NEAR(number_of(run, "qd(lift)", false), -100 * path[1], 1e-12);
        CHECK_NEAR(number_of(run, "qdd(lift)", false), 1e4 * path[2], 3e-8);
        kempe_trajectory_free(run);
        unload(&l);
        kmp_table_free(polar);
    }
}

/* A sweep over a nose that is narrower than the longest step: every row is on it, a knife's by the table itself. */
static void a_sweep_passes_a_narrow_nose(void)
{
    enum { PLACES = 181, ROWS = 361 };
    static char text[16384], model[20000];
    static double x[PLACES], y[PLACES];
    for (int k = 0; k < PLACES; k++)
        y[k] = 0.03 + 0.01 * exp(-pow((2 * pi * k / (PLACES - 1) - 3) / 0.06, 2));
    write_polar(text, sizeof text, PLACES, x, y);
    (void)snprintf(model, sizeof model,
                   "kempe: 1\n%sbodies:\n"
                   "  s: {joint: {name: turn, revolute: z, at: ground}, mass: 1, inertia: {zz: 1}, points: {C: [0, 0, "
                   "0]}}\n"
                   "  v: {joint: {name: lift, prismatic: x, at: ground}, mass: 1, points: {P: [0, 0, 0]}}\n"
                   "loops: {cam: {follower: v.P, knife: yes, on: {outline: disc, at: s.C}}}\nstart: {q: {lift: 0.03}, "
                   "hold: [turn]}\n",
                   text);
    kmp_table *polar = kmp_table_new(KMP_TABLE_PERIODIC, PLACES, x, y);
    loaded l = load_text(model);
    kempe_kinematics *k = NULL;
    kempe_table *rows = NULL;
    const kempe_kinematics_options ask = {.sweep = "turn=0 deg:360 deg:361"};
    CHECK(l.system && kempe_kinematics_new(l.system, &ask, &k) == KEMPE_OK &&
          kempe_kinematics_table(k, "rows", &rows) == KEMPE_OK && kempe_table_row_count(rows) == ROWS);
    static const char *const columns[] = {"q.lift", "qd.lift", "qdd.lift"};
    for (int i = 0; rows && i < ROWS; i++)
        for (int d = 0; d < 3; d++) /* the turn is opposite to the polar angle */
            CHECK_NEAR(kempe_table_number(rows, i, kempe_table_find(rows, columns[d])),
                       (d == 1 ? -1 : 1) * kmp_table_value(polar, d, 2 * pi * (ROWS - 1 - i) / (ROWS - 1)),
                       1e-12 * pow(20, d));
    kempe_table_free(rows);
    kempe_kinematics_free(k);
    unload(&l);
    kmp_table_free(polar);
}

/* A rod from the knife to a rocker reaches the foot of a narrower nose, but not its tip: a range without a row on the
 * nose ends in a dead centre at its side. */
static void a_sweep_stops_at_a_narrow_nose_between_rows(void)
{
    enum { PLACES = 721 };
    const double tip = 0.04, rod = 0.045, pivot = -0.05;
    static char text[65536], model[70000];
    static double x[PLACES], y[PLACES];
    for (int k = 0; k < PLACES; k++)
        y[k] = 0.03 + 0.01 * exp(-pow((2 * pi * k / (PLACES - 1) - 3) / 0.015, 2));
    write_polar(text, sizeof text, PLACES, x, y);
    (void)snprintf(
        model, sizeof model,
        "kempe: 1\n%sground: {points: {G: [%g, 0, 0]}}\nbodies:\n"
        "  s: {joint: {name: turn, revolute: z, at: ground}, mass: 1, inertia: {zz: 1}, points: {C: [0, 0, "
        "0]}}\n"
        "  v: {joint: {name: lift, prismatic: x, at: ground}, mass: 1, points: {P: [0, 0, 0]}}\n"
        "  r: {joint: {name: rocker, revolute: z, at: ground.G}, mass: 1, inertia: {zz: 1}, points: {T: [%g, "
        "0, 0]}}\n"
        "loops: {cam: {follower: v.P, knife: yes, on: {outline: disc, at: s.C}}, rod: {rod: [v.P, r.T], "
        "length: %g}}\nstart: {q: {lift: 0.03, rocker: 0.5}, hold: [turn]}\n",
        text, pivot, tip, rod);
    kmp_table *polar = kmp_table_new(KMP_TABLE_PERIODIC, PLACES, x, y);
    double low = 2.9, high = 3; /* of the polar angle at which the rod is straight; the turn is opposite to it */
    for (int k = 0; k < 60; k++)
        *(kmp_table_value(polar, 0, (low + high) / 2) < tip + rod + pivot ? &low : &high) = (low + high) / 2;
    loaded l = load_text(model);
    static const char *const ranges[] = {"turn=0 rad:-6 rad:2", "turn=0 rad:-6 rad:4", "turn=-0.7 rad:-5 rad:2"};
    for (int i = 0; i < 3; i++) {
        kempe_kinematics *k = NULL;
        kempe_table *dead = NULL;
        const kempe_kinematics_options ask = {.sweep = ranges[i]};
        CHECK(l.system && kempe_kinematics_new(l.system, &ask, &k) == KEMPE_STOPPED &&
              kempe_kinematics_table(k, "dead_centres", &dead) == KEMPE_OK && kempe_table_row_count(dead) == 1);
        if (dead && kempe_table_row_count(dead) == 1)
            CHECK_NEAR(kempe_table_number(dead, 0, kempe_table_find(dead, "value")), -low, 1e-10);
        kempe_table_free(dead);
        kempe_kinematics_free(k);
    }
    unload(&l);
    kmp_table_free(polar);
}

/* A nose between two nodes of the search, narrower than their distance, and noise under a flat face: the search misses
 * the place of contact. */
static void abrupt_profiles_are_refused(void)
{
    static char text[100000], model[110000];
    static double x[MOST_PLACES], y[MOST_PLACES];
    static const struct {
        const char *loop, *words;
        int places;
        double nose, noise;
    } cases[] = {
        {"roller: 1 mm", "loop 'cam': the place of contact on 'disc' is not found at the polar angle 123", 2001, 1e-5,
         0},
        {"roller: 8 mm", "or take a smaller roller", 2001, 1e-6, 0},
        {"flat: x", "is not found at the polar angle", 543, 0, 1e-6},
    };
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        random_seed(5);
        for (int k = 0; k < cases[c].places; k++) {
            const double off = (2 * pi * k / (cases[c].places - 1) - 2 * pi * 700.5 / 2048) / 3e-4;
            y[k] = 0.03 + cases[c].nose * exp(-off * off) + cases[c].noise * between(-0.5, 0.5);
        }
        write_polar(text, sizeof text, cases[c].places, x, y);
        (void)snprintf(model, sizeof model,
                       "kempe: 1\n%sbodies:\n"
                       "  s: {joint: {revolute: z, at: ground}, mass: 1, inertia: {zz: 1}, points: {C: [0, 0, 0]}}\n"
                       "  v: {joint: {prismatic: x, at: ground}, mass: 1, points: {P: [0, 0, 0]}}\n"
                       "loops: {cam: {follower: v.P, %s, on: {outline: disc, at: s.C}}}\n",
                       text, cases[c].loop);
        load_rejected(model, cases[c].words);
    }
}

/* -- a geared cam and a rocker ----------------------------------------------------------------------------- */

/* The wheel A turns the cam on the wheel B, which is half as fast and opposite. A roller on the cam lifts a slide along
 * x, and a rod from there turns a rocker: one coordinate, and each of the others is a function of it. */
enum { CAM_PLACES = 91 };
static const double TIP = 0.05, ROD = 0.09, PIVOT[2] = {0.12, -0.04};

static double radius_of_profile(int k)
{
    const double u = 2 * pi * k / (CAM_PLACES - 1);
    return 0.04 + 0.004 * cos(u + 0.3) + 0.0008 * cos(3 * u);
}

/* The distance of the roller and its derivative at the polar angle of the cam. */
static void lift_towards(const kmp_table *polar, double angle, double lift[2])
{
    double low = -0.5, high = 0.5, path[3];
    angle -= 2 * pi * floor(angle / (2 * pi));
    for (int k = 0; k < 60; k++) { /* u is near the angle, within a turn */
        double u = angle + (low + high) / 2;
        const double turns = floor(u / (2 * pi));
        u -= 2 * pi * turns;
        *(roller_path(polar, u, ROLLER, path) + 2 * pi * turns < angle ? &low : &high) = (low + high) / 2;
    }
    lift[0] = path[0];
    lift[1] = path[1];
}

/* The angle of the rocker whose tip is at the rod's length from the slide, and its slope. */
static double rocker_at(double slide, double *slope)
{
    const double x = slide - PIVOT[0], y = -PIVOT[1], far = hypot(x, y);
    const double angle = atan2(y, x) - acos((far * far + TIP * TIP - ROD * ROD) / (2 * far * TIP));
    const double rod[2] = {TIP * cos(angle) - x, TIP * sin(angle) - y};
    *slope = rod[0] / (TIP * (rod[1] * cos(angle) - rod[0] * sin(angle)));
    return angle;
}

/* Inertia about A, and the torque of a force on the slide by unit of it. */
static double geared_inertia(const kmp_table *polar, double a, double *arm)
{
    double lift[2], slope;
    lift_towards(polar, 0.5 * a, lift); /* the cam turns by -a/2 */
    (void)rocker_at(lift[0], &slope);
    *arm = 0.5 * lift[1];
    return 0.002 + 0.25 * 0.001 + *arm * *arm * (0.5 + 3e-4 * slope * slope);
}

static double geared_acceleration(const kmp_table *polar, double torque, double a, double v)
{
    double arm, other;
    const double h = 1e-5, inertia = geared_inertia(polar, a, &arm);
    const double rate = (geared_inertia(polar, a + h, &other) - geared_inertia(polar, a - h, &other)) / (2 * h);
    return (torque - 60 * arm - rate * v * v / 2) / inertia;
}

static void geared_motion(const kmp_table *polar, double torque, double end, double *a, double *v)
{
    enum { STEPS = 400 };
    const double h = end / STEPS;
    for (int i = 0; i < STEPS; i++) {
        double da[4], dv[4];
        for (int s = 0; s < 4; s++) {
            const double part = s == 0 ? 0 : s == 3 ? h : h / 2;
            da[s] = *v + (s ? part * dv[s - 1] : 0);
            dv[s] = geared_acceleration(polar, torque, *a + (s ? part * da[s - 1] : 0), da[s]);
        }
        *a += h / 6 * (da[0] + 2 * da[1] + 2 * da[2] + da[3]);
        *v += h / 6 * (dv[0] + 2 * dv[1] + 2 * dv[2] + dv[3]);
    }
}

static void a_geared_cam_drives_a_rocker(void)
{
    static char text[8192], model[10000];
    static double x[CAM_PLACES], y[CAM_PLACES];
    const double torques[] = {0.3, 0.7, -0.2}, end = 0.05;
    for (int k = 0; k < CAM_PLACES; k++)
        y[k] = radius_of_profile(k);
    write_polar(text, sizeof text, CAM_PLACES, x, y);
    kmp_table *polar = kmp_table_new(KMP_TABLE_PERIODIC, CAM_PLACES, x, y);
    double lift[2], slope, a[3], v[3];
    lift_towards(polar, 0.5 * 0.4, lift);
    (void)snprintf(
        model, sizeof model,
        "kempe: 1\nparameters: {torque: 0.3}\n%s"
        "ground: {points: {W: [-0.15, 0, 0], G: [%g, %g, 0]}}\nbodies:\n"
        "  a: {joint: {name: A, revolute: z, at: ground.W}, mass: 1, inertia: {zz: 0.002}}\n"
        "  b: {joint: {name: B, revolute: z, at: ground}, mass: 1, inertia: {zz: 0.001}, points: {C: [0, 0, "
        "0]}}\n"
        "  s: {joint: {name: S, prismatic: x, at: ground}, mass: 0.5, points: {P: [0, 0, 0]}}\n"
        "  r: {joint: {name: R, revolute: z, at: ground.G}, mass: 0.2, inertia: {zz: 3e-4}, points: {T: [%g, "
        "0, 0]}}\n"
        "gears: {mesh: {between: [A, B], teeth: [20, 40]}}\n"
        "loops: {cam: {follower: s.P, roller: 8 mm, on: {outline: disc, at: b.C}}, rod: {rod: [s.P, r.T], "
        "length: %g}}\n"
        "forces: {push: {joint: S, force: -60}, turn: {joint: A, torque: torque}}\n"
        "start: {q: {A: 0.4, B: -0.2, S: %.17g, R: %.17g}, qd: {A: 12}, hold: [A]}\n"
        "run: {output_step: 0.01}\n",
        text, PIVOT[0], PIVOT[1], TIP, ROD, lift[0], rocker_at(lift[0], &slope));
    for (int k = 0; k < 3; k++) {
        a[k] = 0.4;
        v[k] = 12;
        geared_motion(polar, torques[k], end, &a[k], &v[k]);
    }
    loaded l = load_text(model);
    for (int w = 0; w < WAYS; w++) {
        kempe_trajectory *run = simulate(&l, &ways[w], end);
        const double near = w < 5 ? 1e-8 : 1e-5;
        CHECK_NEAR(number_of(run, "qdd(A)", false), geared_acceleration(polar, 0.3, 0.4, 12), 1e-5);
        CHECK_NEAR(number_of(run, "q(A)", true), a[0], near);
        CHECK_NEAR(number_of(run, "qd(A)", true), v[0], 100 * near);
        lift_towards(polar, 0.5 * a[0], lift);
        CHECK_NEAR(number_of(run, "q(S)", true), lift[0], near);
        CHECK_NEAR(number_of(run, "q(R)", true), rocker_at(lift[0], &slope), near);
        kempe_trajectory_free(run);
    }
    const kempe_run_options options = {.t_end = end, .rtol = 1e-10};
    static const char *const names[] = {"torque"};
    kempe_values *set = NULL;
    kempe_ensemble *e = NULL;
    kempe_ensemble_result *batch = NULL;
    CHECK(l.model && kempe_values_new(l.model, 1, names, 3, torques, &set) == KEMPE_OK &&
          kempe_ensemble_new(l.model, set, &e) == KEMPE_OK && kempe_ensemble_run(e, &options, 0, &batch) == KEMPE_OK);
    for (int k = 0; k < 3 && batch; k++)
        CHECK_NEAR(kempe_ensemble_result_q(batch, k)[coordinate_named(&l, "A")], a[k], 1e-8);
    kempe_ensemble_result_free(batch);
    kempe_ensemble_free(e);
    kempe_values_free(set);
    unload(&l);
    kmp_table_free(polar);
}

/* C3: the normal force and the torque on the cam, ideal and in contact, by all formulations. */
static void forces_have_their_digits(void)
{
    for (int w = 0; w < WAYS; w++)
        for (int touches = 0; touches < 2; touches++) {
            char model[2048];
            (void)snprintf(model, sizeof model, MACHINE, DISC, "0",
                           touches ? "contacts: {cam: {cylinder: valve.foot, radius: 8 mm, on: {outline: disc, at: "
                                     "shaft.C}, restitution: 0}}"
                                   : "loops: {cam: {follower: valve.foot, roller: 8 mm, on: {outline: disc, at: "
                                     "shaft.C}}}",
                           0.0436477308939579, 0.898340466085883);
            loaded l = load_text(model);
            kempe_trajectory *run = simulate(&l, &ways[w], 0.02);
            CHECK_NEAR(number_of(run, "force(cam)", false), 58.6584247728558, 1e-9);
            CHECK_NEAR(number_of(run, "lambda(motor)", false), 0.516133962269212, 1e-11);
            CHECK_NEAR(number_of(run, "qdd(lift)", false), -60.0835285899863, 1e-9);
            /* behind 2 rad */
            const double angle = 40 * pi / 180 + 2, in = R + ROLLER;
            CHECK_NEAR(number_of(run, "q(lift)", true),
                       E * sin(angle) + sqrt(in * in - E * E * cos(angle) * cos(angle)), 1e-9);
            kempe_trajectory_free(run);
            unload(&l);
        }
}

/* A face is off its point: the normal force has the moment of its place, and turns the shaft with the same arm. */
static void a_face_has_a_moment(void)
{
    char model[2048];
    (void)snprintf(model, sizeof model, MACHINE, DISC, "0",
                   "loops: {cam: {follower: valve.foot, flat: y, on: {outline: disc, at: shaft.C}}}", 0.036, 0.0);
    loaded l = load_text(model);
    kempe_trajectory *run = simulate(&l, &ways[4], 0.001);
    const double angle = 40 * pi / 180;
    const double force = 0.5 * (-E * sin(angle) * 1e4 + 9.81) + 60 + 4000 * (R + E * sin(angle) - 0.038);
    kempe_table *table = NULL;
    CHECK_NEAR(number_of(run, "force(cam)", false), force, 1e-10);
    CHECK(run && kempe_trajectory_outputs(run, "moment(cam)", &table) == KEMPE_OK);
    CHECK_NEAR(table ? kempe_table_number(table, 0, 3) : NAN, E * cos(angle) * force, 1e-12);
    kempe_table_free(table);
    CHECK_NEAR(number_of(run, "lambda(motor)", false), E * cos(angle) * force, 1e-12);
    kempe_trajectory_free(run);
    unload(&l);
}

/* -- levers ------------------------------------------------------------------------------------------------ */

#define LEVER                                                                                                          \
    "kempe: 1\ngravity: [0, -9.81, 0]\noutlines: {disc: {circle: 30 mm, at: [10 mm, 0]}}\n"                            \
    "ground: {points: {O: [0, 0, 0], G: [-60 mm, 40 mm, 0]}}\nbodies:\n"                                               \
    "  shaft: {joint: {name: turn, revolute: z, at: ground.O}, mass: 1, inertia: {zz: 0.001}, points: {C: [0, 0, 0], " \
    "D: [10 mm, 0, 0]}}\n"                                                                                             \
    "  lever: {joint: {name: swing, revolute: z, at: ground.G}, mass: 0.5, com: [40 mm, 0, 0], inertia: {zz: 3e-4}, "  \
    "points: {foot: [60 mm, 0, 0]}}\n"                                                                                 \
    "drives: {motor: {joint: turn, angle: \"0.3 + 20*t\"}}\nstart: {q: {swing: 0.02}}\n"                               \
    "loops: {cam: {%s}}\nrun: {output_step: 0.01}\n"

/* A lever with a roller on an eccentric disc is a four-bar: its coupler is from the centre of the disc to the roller.
 */
static void a_lever_is_a_four_bar(void)
{
    static const char *const loops[] = {"follower: lever.foot, roller: 8 mm, on: {outline: disc, at: shaft.C}",
                                        "rod: [shaft.D, lever.foot], length: 38 mm"};
    static const char *const outputs[] = {"q(swing)", "qd(swing)", "qdd(swing)", "lambda(motor)"};
    for (int w = 0; w < WAYS; w++) {
        double x[2][4], load[2][9] = {{0}};
        for (int k = 0; k < 2; k++) {
            char model[2048];
            (void)snprintf(model, sizeof model, LEVER, loops[k]);
            loaded l = load_text(model);
            kempe_trajectory *run = simulate(&l, &ways[w], 0.3);
            for (int o = 0; o < 4; o++)
                x[k][o] = number_of(run, outputs[o], true);
            static const char *const loads[] = {"reaction(cam)", "reaction(turn)", "reaction(swing)"};
            for (int o = 0; o < 3; o++) {
                kempe_table *table = NULL;
                CHECK(run && kempe_trajectory_outputs(run, loads[o], &table) == KEMPE_OK);
                for (int i = 0; i < 3 && table; i++)
                    load[k][3 * o + i] = kempe_table_number(table, kempe_table_row_count(table) - 1, 1 + i);
                kempe_table_free(table);
            }
            kempe_trajectory_free(run);
            unload(&l);
        }
        for (int o = 0; o < 4; o++)
            CHECK_NEAR(x[0][o], x[1][o], w < 5 ? 1e-8 : 1e-5);
        for (int i = 0; i < 9; i++)
            CHECK_NEAR(load[0][i], load[1][i], w < 5 ? 1e-8 : 1e-5);
    }
}

/* A flat lever on the disc: the centre of the disc keeps the distance R from the face. The load of the pivot balances
 * lever, weight and the force at the place of contact. */
static void a_flat_lever_turns(void)
{
    char model[2048];
    (void)snprintf(model, sizeof model, LEVER, "follower: lever.foot, flat: y, on: {outline: disc, at: shaft.C}");
    loaded l = load_text(model);
    kempe_trajectory *run = simulate(&l, &ways[4], 0.1);
    const double angle = 0.3 + 2, swing = number_of(run, "q(swing)", true);
    const double d[2] = {E * cos(angle) + 0.06, E * sin(angle) - 0.04}, m[2] = {-sin(swing), cos(swing)};
    CHECK_NEAR(d[0] * m[0] + d[1] * m[1], -R, 1e-12);
    const double force = number_of(run, "force(cam)", true);
    const double along = d[0] * cos(swing) + d[1] * sin(swing);
    CHECK_NEAR(3e-4 * number_of(run, "qdd(swing)", true) + 0.5 * 0.04 * 0.04 * number_of(run, "qdd(swing)", true),
               force * along - 0.5 * 9.81 * 0.04 * cos(swing), 1e-10);
    kempe_table *table = NULL;
    CHECK(run && kempe_trajectory_outputs(run, "moment(cam)", &table) == KEMPE_OK);
    CHECK_NEAR(table ? kempe_table_number(table, kempe_table_row_count(table) - 1, 3) : NAN, force * (along - 0.06),
               1e-10);
    kempe_table_free(table);
    kempe_trajectory_free(run);
    unload(&l);
}

/* -- lift-off ---------------------------------------------------------------------------------------------- */

/* The force along y of a roller that stays on the disc, at an angle and a speed. */
static double force_on_disc(double angle, double speed)
{
    const double c = cos(angle), s = sin(angle), root = sqrt((R + ROLLER) * (R + ROLLER) - E * E * c * c);
    const double slope = E * E * c * s / root, bend = (E * E * (c * c - s * s) - slope * slope) / root;
    return 0.5 * ((bend - E * s) * speed * speed + 9.81) + 60 + 4000 * (E * s + root - 0.038);
}

/* The contact opens where the force of the ideal follower is zero, which warns of it. */
static void a_follower_lifts_off(void)
{
    const double speed = 150, begin = 40 * pi / 180;
    double low = begin, high = pi / 2;
    CHECK(force_on_disc(low, speed) > 0 && force_on_disc(high, speed) < 0);
    for (int k = 0; k < 60; k++)
        *(force_on_disc((low + high) / 2, speed) > 0 ? &low : &high) = (low + high) / 2;
    for (int w = 0; w < 7; w += 2) {
        char model[2048];
        (void)snprintf(model, sizeof model, MACHINE, DISC, "0",
                       "contacts: {cam: {cylinder: valve.foot, radius: 8 mm, on: {outline: disc, at: shaft.C}, "
                       "restitution: 0}}",
                       0.0436477308939579, 150 * 0.00898340466085883);
        const kempe_setting set = {"w", "150"};
        loaded l = {.context = kempe_context_new()};
        (void)kempe_model_read_text_set(l.context, model, "model.yaml", &set, 1, &l.model);
        l = load_finish(l);
        kempe_trajectory *run = simulate(&l, &ways[w], 0.02);
        const kmp_log_entry *opens = run ? entry(run, "contact", 1) : NULL;
        CHECK(opens && strstr(opens->text, "opens"));
        CHECK_NEAR(opens ? opens->t : NAN, (low - begin) / speed, w < 5 ? 1e-9 : 1e-6);
        CHECK(number_of(run, "gap(cam)", true) >= -1e-12);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* Thrown up from the dwell of a law, farther than its lever reaches: free flight, and back on the base circle. */
static void a_follower_flies(void)
{
    static const char *const thrown[] = {"roller: 8 mm, arm: 60 mm, distance: 80 mm", "roller: 8 mm, offset: 12 mm",
                                         "knife: yes, arm: -60 mm, distance: 80 mm"};
    for (int k = 0; k < 6; k++) {
        char model[2048];
        const bool roller = k % 3 < 2, swings = k % 3 != 1;
        const double base = roller ? 0.044 : 0.036, speed = 3, flight = 2 * speed / 9.81;
        (void)snprintf(
            model, sizeof model,
            "kempe: 1\ngravity: [0, -9.81, 0]\noutlines: {disc: {law: [{to: 60 deg, rise: %s, by: "
            "cycloidal}, {to: 180 deg}, {to: 260 deg, rise: -%s, by: polynomial_345}, {to: 360 deg}], "
            "base: 36 mm, follower: {%s}}}\nbodies:\n"
            "  shaft: {joint: {name: turn, revolute: z, at: ground}, mass: 1, inertia: {zz: 0.001}, points: "
            "{C: [0, 0, 0]}}\n"
            "  valve: {joint: {name: lift, prismatic: y, at: ground}, mass: 0.5, points: {foot: [0, 0, 0]}}\n"
            "contacts: {cam: {%s, on: {outline: disc, at: shaft.C}, restitution: 0}}\n"
            "drives: {motor: {joint: turn, angle: 40 deg}}\n"
            "start: {q: {lift: %.17g}, qd: {lift: 3}}\nrun: {output_step: 0.01}\n",
            swings ? "6 deg" : "6 mm", swings ? "6 deg" : "6 mm", thrown[k % 3],
            roller ? "cylinder: valve.foot, radius: 8 mm" : "point: valve.foot", base);
        loaded l = load_text(model);
        kempe_trajectory *run = simulate(&l, &ways[k < 3 ? 0 : 3], 1);
        const kmp_log_entry *closes = run ? entry(run, "contact", 0) : NULL;
        CHECK_NEAR(closes ? closes->t : NAN, flight, 1e-9);
        CHECK_NEAR(number_of(run, "q(lift)", false), base, 1e-12);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* The example's roller stays on its cam up to the speed at which the least force over the angle is zero. */
static void a_valve_stays_below_a_speed(void)
{
    static const char *const speeds[] = {"2086.1 rpm", "2086.5 rpm"};
    for (int k = 0; k < 2; k++) {
        const kempe_setting set = {"speed", speeds[k]};
        loaded l = {.context = kempe_context_new()};
        CHECK(kempe_model_read_set(l.context, "examples/valve_train/valve_train.yaml", &set, 1, &l.model) == KEMPE_OK);
        l = load_finish(l);
        kempe_trajectory *run = simulate(&l, &ways[3], 0.006);
        CHECK((run && entry(run, "contact", 1)) == (k == 1));
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* -- pairs --------------------------------------------------------------------------------------------------- */

/* Derivatives of lift and force by the speed and the stiffness are differences of runs. */
static void derivatives_follow_parameters(void)
{
    char model[2048];
    kempe_context *context = kempe_context_new();
    (void)snprintf(model, sizeof model, MACHINE, DISC, "0",
                   "loops: {cam: {follower: valve.foot, roller: 8 mm, on: {outline: disc, at: shaft.C}}}", 0.043, 0.0);
    kempe_sensitivity *s =
        sensitivity_of("forward", context, model, "q(lift), force(cam), pressure_angle(cam)", "radau", 0.01, 0);
    CHECK(s && s->count == 2 && s->columns == 3 && s->rows == 2);
    for (int p = 0; s && p < s->count; p++) {
        static const char *const outputs[] = {"q(lift)", "force(cam)", "pressure_angle(cam)"};
        double slope[3];
        slopes_of_runs(s, p, model, 0.01, 3, outputs, slope);
        for (int o = 0; o < 3; o++)
            CHECK_NEAR(last_slope(s, p, o), slope[o], 1e-5 * (1e-3 + fabs(slope[o])));
    }
    kempe_sensitivity_free(s);
    kempe_context_free(context);
}

/* A shaft on a spring that a valve pushes back: its balance, and the frequency about it. */
static void a_cam_rests_and_oscillates(void)
{
    loaded l = load_text(
        "kempe: 1\ngravity: [0, -9.81, 0]\noutlines: {disc: {law: [{to: 180 deg, rise: 10 mm, by: modified_sine}, {to: "
        "360 deg, rise: -10 mm, by: cycloidal}], base: 30 mm, follower: {roller: 8 mm}}}\nbodies:\n"
        "  shaft: {joint: {name: turn, revolute: z, at: ground}, mass: 1, inertia: {zz: 0.001}, points: {C: [0, 0, "
        "0]}}\n"
        "  valve: {joint: {name: lift, prismatic: y, at: ground}, mass: 0.5, points: {foot: [0, 0, 0]}}\n"
        "forces: {spring: {joint: lift, force: \"-60 - 4000*(q(lift) - 0.038)\"}, hold: {joint: turn, torque: \"5*(2.5 "
        "- q(turn))\"}}\nloops: {cam: {follower: valve.foot, roller: 8 mm, on: {outline: disc, at: shaft.C}}}\n"
        "start: {q: {turn: 2.4, lift: 0.04}}\n");
    kempe_equilibrium *e = NULL;
    kempe_modes *modes = NULL;
    kempe_table *table = NULL, *frequencies = NULL;
    double s[3] = {0}, force = 0, turn = NAN;
    CHECK(l.system && kempe_equilibrium_new(l.system, NULL, &e) == KEMPE_OK &&
          kempe_equilibrium_table(e, "equilibria", &table) == KEMPE_OK &&
          kempe_modes_new(l.system, NULL, &modes) == KEMPE_OK &&
          kempe_modes_table(modes, "modes", &frequencies) == KEMPE_OK);
    if (table && frequencies) {
        turn = kempe_table_number(table, 0, kempe_table_find(table, "q.turn"));
        for (int d = 0; d < 3; d++)
            s[d] = 0.01 * kmp_cam_law_value(KMP_CAM_MODIFIED_SINE, d, (turn - pi / 2) / pi) / pow(pi, d);
        force = 60 + 4000 * s[0] + 0.5 * 9.81;
        const double stiffness = 5 + force * s[2] + 4000 * s[1] * s[1], inertia = 0.001 + 0.5 * s[1] * s[1];
        CHECK_NEAR(5 * (2.5 - turn) - force * s[1], 0, 1e-10);
        CHECK_NEAR(fabs(kempe_table_number(frequencies, 0, kempe_table_find(frequencies, "im"))),
                   sqrt(stiffness / inertia), 1e-8);
    }
    CHECK(isfinite(turn));
    kempe_table_free(frequencies);
    kempe_table_free(table);
    kempe_modes_free(modes);
    kempe_equilibrium_free(e);
    unload(&l);
}

/* Instances in lanes have the lift of their angle, with a law too. */
static void instances_are_runs(void)
{
    static const char *const names[] = {"w"};
    static const double values[] = {60, 70, 80, 90, 95};
    for (int c = 0; c < 4; c++) {
        const bool law = c % 2, touches = c / 2;
        char model[2048];
        (void)snprintf(model, sizeof model, MACHINE,
                       law ? "outlines: {disc: {law: [{to: 180 deg, rise: 10 mm, by: modified_sine}, {to: 360 deg, "
                             "rise: -10 mm, by: cycloidal}], base: 30 mm, follower: {roller: 8 mm}}}\n"
                           : DISC,
                       "0",
                       touches ? "contacts: {cam: {cylinder: valve.foot, radius: 8 mm, on: {outline: disc, at: "
                                 "shaft.C}, restitution: 0}}"
                               : "loops: {cam: {follower: valve.foot, roller: 8 mm, on: {outline: disc, at: shaft.C}}}",
                       law ? 0.0395 : 0.0437, 0.0);
        loaded l = load_text(model);
        const kempe_run_options options = {.t_end = 0.01, .rtol = 1e-10};
        kempe_values *set = NULL;
        kempe_ensemble *e = NULL;
        kempe_ensemble_result *batch = NULL;
        CHECK(l.model && kempe_values_new(l.model, 1, names, 5, values, &set) == KEMPE_OK &&
              kempe_ensemble_new(l.model, set, &e) == KEMPE_OK &&
              kempe_ensemble_run(e, &options, 0, &batch) == KEMPE_OK);
        const int lift = coordinate_named(&l, "lift");
        for (int k = 0; k < 5 && batch; k++) {
            /* the follower is along y: a quarter of a turn before the law's zero */
            const double angle = 40 * pi / 180 + 0.01 * values[k],
                         x = (angle - pi / 2 + (angle < pi / 2 ? 2 * pi : 0)) / pi;
            const double cosine = cos(angle), in = R + ROLLER;
            const double of_law = 0.038 + 0.01 * (kmp_cam_law_value(KMP_CAM_MODIFIED_SINE, 0, x) -
                                                  kmp_cam_law_value(KMP_CAM_CYCLOIDAL, 0, x - 1));
            CHECK_NEAR(kempe_ensemble_result_q(batch, k)[lift],
                       law ? of_law : E * sin(angle) + sqrt(in * in - E * E * cosine * cosine), 1e-10);
        }
        kempe_ensemble_result_free(batch);
        kempe_ensemble_free(e);
        kempe_values_free(set);
        unload(&l);
    }
}

/* -- refusals ------------------------------------------------------------------------------------------------- */

#define REFUSED                                                                                                        \
    "kempe: 1\ntables: {r: {periodic: yes, x: [0, 120 deg, 240 deg, 360 deg], y: [0.03, 0.03, 0.03, 0.03]}, half: "    \
    "{periodic: yes, x: [0, 90 deg, 180 deg], y: [0.03, 0.03, 0.03]}, open: {x: [0, 90 deg, 360 deg], y: [0.03, "      \
    "0.03, 0.03], outside: linear}}\noutlines:\n  c: {%s}\n  box: {rectangle: [1, 1]}\nbodies:\n"                      \
    "  s: {joint: {revolute: z, at: ground}, mass: 1, inertia: {zz: 1}, points: {C: [0, 0, 0]}}\n"                     \
    "  v: {joint: {prismatic: x, at: ground}, mass: 1, points: {P: [0, 0, 0], Q: {at: [0, 0, 0], axes: {z: x, x: "     \
    "y}}}}\n%s\n"
#define ON ", on: {outline: c, at: s.C}}}"

static void refused(void)
{
    static const char *const good = "circle: 0.03, at: [0.01, 0]";
    static const struct {
        const char *outline, *loop, *words;
    } cases[] = {
        {"law: [{to: 90 deg, rise: 0.01, by: cycloidal}, {to: 360 deg}], base: 0.03, follower: {knife: yes}", "",
         "model.yaml:4:12: outline 'c': the sum of the rises is 0.01 m: it must be zero"},
        {"law: [{to: 90 deg, rise: 0.1, by: cycloidal}, {to: 360 deg}], base: 0.03, follower: {knife: yes, arm: 0.06, "
         "distance: 0.08}",
         "", "the sum of the rises is 0.1 rad"},
        {"law: [{to: 360 deg}], base: 0.03, follower: {knife: yes, arm: 0.06}", "",
         "'arm' and 'distance' belong together"},
        {"law: [{to: 360 deg}], base: 0.03, follower: {knife: yes, arm: 0.06, distance: 0.1}", "",
         "a lever of 0.06 m at the distance 0.1 m does not reach the base circle: its roller is 0.03 m from the "
         "centre"},
        {"law: [{to: 360 deg}], base: 0.03, follower: {knife: yes, offset: 0.04}", "", "the offset is 0.04 m"},
        {"law: [{to: 360 deg}], base: 0.03, follower: {flat: yes, offset: 0.01}", "",
         "the key 'offset' belongs to a roller or a knife"},
        {"law: [{to: 90 deg, rise: 0.01, by: cycloidal}, {to: 300 deg, rise: -0.01, by: harmonic}], base: 0.03, "
         "follower: {knife: yes}",
         "", "ends at 300 deg, not at 360 deg"},
        {"law: [{to: 90 deg, rise: 0.01, by: linear}, {to: 360 deg, rise: -0.01, by: harmonic}], base: 0.03, "
         "follower: {knife: yes}",
         "", "'linear' has corners at both ends"},
        {"law: [{to: 90 deg, rise: 0.01, by: bezier}, {to: 360 deg, rise: -0.01, by: harmonic}], base: 0.03, "
         "follower: {knife: yes}",
         "", "by is linear, harmonic, cycloidal"},
        {"law: [{to: 90 deg, rise: 0.01}, {to: 360 deg}], base: 0.03, follower: {knife: yes}", "", "has no key 'by'"},
        {"law: [{to: 90 deg, by: harmonic}, {to: 360 deg}], base: 0.03, follower: {knife: yes}", "",
         "a part without 'rise' is a dwell"},
        {"law: [{to: 90 deg}, {to: 80 deg}], base: 0.03, follower: {knife: yes}", "",
         "this part ends at 80 deg, where it begins at 90 deg"},
        {"law: [{to: 10 deg, rise: 0.01, by: cycloidal}, {to: 360 deg, rise: -0.01, by: cycloidal}], base: 0.03, "
         "follower: {roller: 0.01}",
         "", "has a cusp at the polar angle"},
        {"law: [{to: 360 deg}], base: 0.03", "", "has no key 'follower'"},
        {"law: [{to: 360 deg}], follower: {knife: yes}", "", "has no key 'base'"},
        {"polar: half", "", "the table 'half' covers 180 deg: a cam has one turn"},
        {"polar: open", "", "must be a spline with 'periodic: yes'"},
        {"polar: r, round: 1", "", "the key 'round' does not belong to a 'polar'"},
        {"points: [[0.03, 0], [0, 0.03], [-0.03, 0]]", "", "needs four places or more"},
        {"points: [[0.03, 0], [0, -0.03], [-0.03, 0], [0, 0.03]]", "", "the places go clockwise"},
        {"points: [[0.03, 0], [0, 0.03], [0, 0.03], [0, -0.03]]", "", "place 3 is the same as place 2"},
        {"points: [[0.03, 0], [0, 0.03], [-0.03, 0], [-0.004, -0.004], [0, -0.03]]",
         "loops: {cam: {follower: v.P, roller: 0.02" ON, "a roller of radius 0.02 m touches it at two places"},
        {"points: [[0.03, 0], [0, 0.03], [-0.03, 0], [-0.004, -0.004], [0, -0.03]]",
         "loops: {cam: {follower: v.P, flat: x" ON, "a flat face touches it at two places"},
        {"points: [[0.03, 0], [0, 0.03], [-0.03, 0], [-0.004, -0.004], [0, -0.03]]",
         "contacts: {cam: {flat: v.P, normal: x, restitution: 0" ON, "a flat face touches it at two places"},
        {NULL, "loops: {cam: {follower: v.P, roller: 0.02, knife: yes" ON, "roller"},
        {NULL, "loops: {cam: {follower: v.P" ON, "roller"},
        {NULL, "loops: {cam: {follower: v.P, roller: -1" ON, "must be positive"},
        {NULL, "loops: {cam: {follower: v.P, roller: 0.01}}", "has no key 'on'"},
        {NULL, "loops: {cam: {follower: v.P, roller: 0.01, on: {outline: d, at: s.C}}}", "unknown outline 'd'"},
        {NULL, "loops: {cam: {follower: v.P, roller: 0.01, on: {outline: box, at: s.C}}}",
         "the outline 'box' is not a cam"},
        {NULL, "loops: {cam: {follower: s.C, roller: 0.01" ON, "are on the same body"},
        {NULL, "loops: {cam: {follower: v.P, flat: z" ON, "does not stay in the plane of the cam"},
        {NULL, "loops: {cam: {rod: [v.P, s.C], length: 1, flat: z}}", "a rod closure has no flat"},
        {NULL, "contacts: {cam: {cylinder: v.Q, radius: 0.01, restitution: 0" ON, "does not stay parallel"},
        {NULL, "contacts: {cam: {flat: v.P, restitution: 0, on: {plane: s.C}}}", "a flat face touches an 'outline'"},
        {NULL, "contacts: {cam: {point: v.P, normal: x, restitution: 0" ON, "'normal' does not belong to a 'point'"},
        {NULL, "loops: {cam: {rod: [v.P, s.C], length: 1}}\nrun: {outputs: [pressure_angle(cam)]}", "unknown force"},
        {NULL, "forces: {f: {joint: v, force: 1}}\nrun: {outputs: [curvature(f)]}", "'f' is not a follower on a cam"}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        char model[2048];
        (void)snprintf(model, sizeof model, REFUSED, cases[k].outline ? cases[k].outline : good, cases[k].loop);
        load_rejected(model, cases[k].words);
    }
}

int main(void)
{
    TEST(laws_have_their_digits);
    TEST(laws_are_smooth);
    TEST(a_model_has_the_law);
    TEST(a_law_has_its_pressure_angle);
    TEST(followers_beside_the_centre_have_the_law);
    TEST(profiles_beside_the_centre_are_right);
    TEST(a_hollow_profile_is_found);
    TEST(other_followers_share_the_profile);
    TEST(followers_lift);
    TEST(a_path_is_exact);
    TEST(random_profiles_are_found);
    TEST(a_sweep_passes_a_narrow_nose);
    TEST(a_sweep_stops_at_a_narrow_nose_between_rows);
    TEST(abrupt_profiles_are_refused);
    TEST(a_geared_cam_drives_a_rocker);
    TEST(forces_have_their_digits);
    TEST(a_face_has_a_moment);
    TEST(a_lever_is_a_four_bar);
    TEST(a_flat_lever_turns);
    TEST(a_follower_lifts_off);
    TEST(a_follower_flies);
    TEST(a_valve_stays_below_a_speed);
    TEST(derivatives_follow_parameters);
    TEST(a_cam_rests_and_oscillates);
    TEST(instances_are_runs);
    TEST(refused);
    return check_report();
}
