/* SPDX-License-Identifier: BSD-3-Clause */
/* wings: rail */
/* Courses of tracks: the middle line against clothoids and circles, and what is beside it. */
#include "model/data/model.h"
#include "sections.h"

static kempe_context *context;

static const char tail[] =
    "ground: {points: {O: [0, 0, 0]}}\nbodies: {a: {joint: {prismatic: x, at: ground}, mass: 1}}\n"
    "profiles: {head: {y: [-36 mm, -30 mm, -20 mm, 0, 20 mm, 30 mm, 36 mm],"
    " z: [-28 mm, -9 mm, -1 mm, 0, -1 mm, -9 mm, -28 mm]}}\n";

static kempe_model *read_course(const char *course)
{
    char text[2048];
    kempe_model *model = NULL;
    (void)snprintf(text, sizeof text,
                   "kempe: 1\ntracks: {line: {at: ground.O, rail: head, gauge: 1435 mm, course: %s}}\n%s", course,
                   tail);
    if (kempe_model_read_text(context, text, "model.yaml", &model) != KEMPE_OK)
        printf("%s\n", kempe_context_message(context));
    CHECK(model != NULL);
    return model;
}

static double angle_between(double a, double b)
{
    return fabs(remainder(a - b, 2 * acos(-1)));
}

static double heading_at(const kmp_track *t, double s)
{
    return atan2(kmp_table_value(t->y, 1, s), kmp_table_value(t->x, 1, s));
}

/* -- the line -------------------------------------------------------------------------------------- */

/* Fresnel's integrals by their series: a clothoid whose curvature is s / a2 (Abramowitz and Stegun 1964, 7.3.11). */
static void clothoid(double s, double a2, double *x, double *y)
{
    double tau = s * s / (2 * a2), term = s;
    *x = *y = 0;
    for (int n = 0; n < 60; n++) {
        *(n % 2 ? y : x) += (n % 4 < 2 ? 1 : -1) * term / (2 * n + 1);
        term *= tau / (n + 1);
    }
}

/* Straight, clothoid, circle: x, y and heading. */
static void exact_at(double s, double before, double length, double radius, double out[3])
{
    double a2 = length * radius, x, y, u = fmin(fmax(s - before, 0), length);
    clothoid(u, a2, &x, &y);
    double angle = u * u / (2 * a2), turn = fmax(s - before - length, 0) / radius;
    out[0] = fmin(s, before) + x + radius * (sin(angle + turn) - sin(angle));
    out[1] = y - radius * (cos(angle + turn) - cos(angle));
    out[2] = angle + turn;
}

static void follows_line(const char *course, double before, double length, double radius, double until)
{
    kempe_model *m = read_course(course);
    if (!m)
        return;
    const kmp_track *t = &m->tracks[0];
    double worst = 0, turned = 0, stretched = 0, exact[3];
    for (double s = -3; s < until; s += until / 20011) {
        exact_at(s, before, length, radius, exact);
        worst = check_max(worst, hypot(kmp_table_value(t->x, 0, s) - exact[0], kmp_table_value(t->y, 0, s) - exact[1]));
        turned = check_max(turned, angle_between(heading_at(t, s), exact[2]));
        stretched = check_max(stretched, fabs(hypot(kmp_table_value(t->x, 1, s), kmp_table_value(t->y, 1, s)) - 1));
    }
    printf("%s: %d points, %d candidates; off %.2g m, %.2g rad, stretched %.2g\n", course, t->x->count,
           t->candidate_count, worst, turned, stretched);
    CHECK(worst < 1e-9 && turned < 1e-8 && stretched < 1e-8);
    kempe_model_free(m);
}

static void clothoids(void)
{
    follows_line("[{straight: 5}, {transition: 12}, {left: 120, radius: 20, cant: 0.12}, {transition: 5}]", 5, 12, 20,
                 136.97);
    follows_line("[{straight: 100}, {transition: 60}, {left: 400, radius: 300}]", 100, 60, 300, 559.9);
    follows_line("[{straight: 1000}, {transition: 200}, {left: 1000, radius: 1500, cant: 0.1}, {transition: 200}]",
                 1000, 200, 1500, 2199.9);
}

/* A course that is the same from both ends: its halves are mirror images, out of a transition as into one; and so are
 * the same course to the left and to the right, with the other rail up. */
static void mirrors(void)
{
    static const char *const courses[2] = {
        "[{transition: 20}, {left: 30, radius: 40, cant: 80 mm}, {transition: 20}]",
        "[{transition: 20}, {right: 30, radius: 40, cant: 80 mm}, {transition: 20}]"};
    kempe_model *m[2] = {read_course(courses[0]), read_course(courses[1])};
    if (!m[0] || !m[1])
        return;
    const kmp_track *t = &m[0]->tracks[0], *other = &m[1]->tracks[0];
    double end[2] = {kmp_table_value(t->x, 0, 70), kmp_table_value(t->y, 0, 70)};
    CHECK(angle_between(heading_at(t, 70), 50.0 / 40) < 1e-9);
    for (double s = 0; s < 70; s += 0.61) {
        double x = kmp_table_value(t->x, 0, s), y = kmp_table_value(t->y, 0, s);
        CHECK_NEAR(hypot(x, y),
                   hypot(kmp_table_value(t->x, 0, 70 - s) - end[0], kmp_table_value(t->y, 0, 70 - s) - end[1]), 1e-11);
        CHECK_NEAR(kmp_table_value(t->cant, 0, s), kmp_table_value(t->cant, 0, 70 - s), 1e-9);
        CHECK(kmp_table_value(other->x, 0, s) == x && kmp_table_value(other->y, 0, s) == -y);
        CHECK(kmp_table_value(other->cant, 0, s) == -kmp_table_value(t->cant, 0, s));
    }
    CHECK_NEAR(kmp_table_value(t->cant, 0, 35), -asin(0.08 / (2 * t->rail_at)), 1e-12);
    kempe_model_free(m[0]);
    kempe_model_free(m[1]);
}

/* Instead of a jump, curvature has a transition of 5 cm: the circle is then beside its place by curvature 0.05^2 / 24,
 * as any transition shifts it (the first term of its series). */
static void jumps(void)
{
    kempe_model *m = read_course("[{straight: 2}, {right: 60, radius: 25}]");
    if (!m)
        return;
    const kmp_track *t = &m->tracks[0];
    for (double s = 2.1; s < 61.8; s += 0.5) {
        double a = (s - 2) / 25, x = kmp_table_value(t->x, 0, s) - 2 - 25 * sin(a);
        CHECK_NEAR(hypot(x, kmp_table_value(t->y, 0, s) + 25 - 25 * cos(a)), 0.05 * 0.05 / 24 / 25, 1e-8);
        CHECK(angle_between(heading_at(t, s), -a) < 1e-8);
    }
    for (double s = 62.1; s < 70; s += 0.5) /* straight behind it */
        CHECK(angle_between(heading_at(t, s), -60.0 / 25) < 1e-8);
    kempe_model_free(m);
}

/* -- what is beside it --------------------------------------------------------------------------------- */

/* Everything beside a course that comes back to itself, 50 m round and 4 m aside, finds its place. */
static void finds_places(void)
{
    kempe_model *m = read_course(
        "[{straight: 300}, {transition: 8}, {right: 20, radius: 25, cant: 0.05}, {transition: 8}, {straight: 2},"
        " {transition: 8}, {left: 98.5, radius: 25, cant: 0.05}, {transition: 8}, {straight: 310}]");
    section s;
    if (!m || !section_init(&s, m, &m->tracks[0]))
        return;
    const kmp_track *t = &m->tracks[0];
    double worst = 0, off = 0;
    for (double along = -5; along < t->length + 5; along += 1.37)
        for (int side = -1; side <= 1; side++) {
            double a = heading_at(t, along), lateral = 0.9 * side, cross = 0;
            const double point[3] = {kmp_table_value(t->x, 0, along) - lateral * sin(a),
                                     kmp_table_value(t->y, 0, along) + lateral * cos(a), 0.46};
            section_at(&s, point);
            worst = check_max(worst, fabs(s.value[ALONG] - along));
            for (int k = 0; k < 3; k++)
                cross += (point[k] - s.value[ORIGIN + k]) * s.value[AXES + k];
            off = check_max(off, fabs(cross));
        }
    printf("terminus: %d points, %d candidates; %.2g m off, %.2g m out of its plane; ends at y = %.3g, heading %.3g\n",
           t->x->count, t->candidate_count, worst, off, kmp_table_value(t->y, 0, t->length), heading_at(t, t->length));
    CHECK(worst < 1e-11 && off < 1e-12);
    section_free(&s);
    kempe_model_free(m);
}

/* Right-handed unit axes; the outer rail is up by the cant over the rails' middles. */
static void canted(void)
{
    kempe_model *m = read_course("[{transition: 20}, {right: 30, radius: 40, cant: 80 mm}, {transition: 20}]");
    section s;
    if (!m || !section_init(&s, m, &m->tracks[0]))
        return;
    const kmp_track *t = &m->tracks[0];
    for (double along = 0.7; along < 49; along += 3.1) {
        const double point[3] = {kmp_table_value(t->x, 0, along), kmp_table_value(t->y, 0, along), 0};
        section_at(&s, point);
        const double *a = s.value + AXES;
        for (int i = 0; i < 3; i++) {
            const double *b = a + 3 * i, *c = a + 3 * ((i + 1) % 3), *d = a + 3 * ((i + 2) % 3);
            CHECK_NEAR(b[0] * b[0] + b[1] * b[1] + b[2] * b[2], 1, 1e-15);
            for (int k = 0; k < 3; k++)
                CHECK_NEAR(b[k], c[(k + 1) % 3] * d[(k + 2) % 3] - c[(k + 2) % 3] * d[(k + 1) % 3], 1e-15);
        }
        /* the ramp's slope is reached after half a metre, over 20 m less that */
        double angle = asin(0.08 / (2 * t->rail_at)), slope = angle / 19.5;
        CHECK_NEAR(asin(a[5]), along > 20 ? angle : slope * (along - 0.25), 1e-9);
    }
    section_free(&s);
    kempe_model_free(m);
}

/* Derivatives of everything against differences, in straights, transitions and curves. */
static void slopes(void)
{
    kempe_model *m =
        read_course("[{straight: 5}, {transition: 20}, {left: 40, radius: 15, cant: 0.1}, {transition: 20}]");
    section s;
    if (!m || !section_init(&s, m, &m->tracks[0]))
        return;
    const kmp_track *t = &m->tracks[0];
    for (double along = 2.03; along < 90; along += 7.9) {
        double a = heading_at(t, along), h = 1e-4, slope[3 * VALUES], low[VALUES];
        double p[3] = {kmp_table_value(t->x, 0, along) + 0.7 * sin(a), kmp_table_value(t->y, 0, along) - 0.7 * cos(a),
                       0.4};
        section_at(&s, p);
        memcpy(slope, s.slope, sizeof slope);
        for (int k = 0; k < 3; k++) {
            double at = p[k];
            p[k] = at - h;
            section_at(&s, p);
            memcpy(low, s.value, sizeof low);
            p[k] = at + h;
            section_at(&s, p);
            p[k] = at;
            for (int i = 0; i < VALUES; i++)
                CHECK_NEAR((s.value[i] - low[i]) / (2 * h), slope[k * VALUES + i], 1e-8);
        }
    }
    section_free(&s);
    kempe_model_free(m);
}

/* A straight track costs a projection, whose factors are 0 and 1 here. */
static void costs(void)
{
    static const char *const courses[3] = {"[]", "[{left: 10, radius: 30}]",
                                           "[{transition: 10}, {left: 10, radius: 30, cant: 0.1}, {transition: 10}]"};
    for (int k = 0; k < 3; k++) {
        kempe_model *m = read_course(courses[k]);
        section s;
        if (m && section_init(&s, m, &m->tracks[0])) {
            kmp_counts counts = kmp_program_count(s.program, 0, 1);
            printf("%s: %ld operations\n", courses[k], counts.robotran);
            CHECK(s.program->block_count == (k > 0) && (k > 0 || counts.robotran == 0));
            section_free(&s);
        }
        kempe_model_free(m);
    }
}

int main(void)
{
    context = kempe_context_new();
    TEST(clothoids);
    TEST(mirrors);
    TEST(jumps);
    TEST(finds_places);
    TEST(canted);
    TEST(slopes);
    TEST(costs);
    kempe_context_free(context);
    return check_report();
}
