/* SPDX-License-Identifier: BSD-3-Clause */
/* A base curve c(u), with u counter-clockwise, has the unit normal n outwards and the curvature k, positive where it is
 * convex. Profile and path of a roller are parallel to it: c + d n. They have no cusp where 1 + d k > 0. */
#include "model/data/cam.h"
#include "base/memory.h"
#include "constraints/tolerances.h"
#include "model/data/outline.h"
#include "model/language/dimension.h"
#include "symbolic/graph.h"
#include <math.h>
#include <string.h>

#define PI (KMP_TURN / 2)

/* Places round a cam, at which it is checked and between which the search for a place begins. */
enum { PLACES = 2048 };

const char *const kmp_cam_law_words[KMP_CAM_LAWS] = {
#define KMP_CAM_LAW(kind, word, ...) #word,
#include "model/data/cam_laws.def"
#undef KMP_CAM_LAW
};

/* -- laws ------------------------------------------------------------------------------------------------ */

/* The modified sine with k = 1/(4 + pi); the modified trapezoid with the largest acceleration a = 8 pi/(2 + pi). */
#define MS_K 0.14002478837788934
#define MT_A 4.88812376281325855
#define MT_W 12.5663706143591730 /* 4 pi */
/* Rate and place of the modified trapezoid at 1/8, 3/8 and 5/8 of its angle. */
#define MT_V1 (MT_A / MT_W)
#define MT_S1 (MT_A * (0.125 / MT_W - 1 / (MT_W * MT_W)))
#define MT_V2 (MT_V1 + MT_A / 4)
#define MT_S2 (MT_S1 + MT_V1 / 4 + MT_A / 32)
#define MT_S3 (1 - MT_S2)
#define MT_S4 (1 - MT_S1)

static const kmp_cam_piece linear[] = {{.to = 1, .power = {0, 1}}};
static const kmp_cam_piece harmonic[] = {{.to = 1, .power = {0.5}, .size = -0.5, .rate = PI, .phase = PI / 2}};
static const kmp_cam_piece cycloidal[] = {{.to = 1, .power = {0, 1}, .size = -1 / KMP_TURN, .rate = KMP_TURN}};
static const kmp_cam_piece polynomial_345[] = {{.to = 1, .power = {0, 0, 0, 10, -15, 6}}};
static const kmp_cam_piece polynomial_4567[] = {{.to = 1, .power = {0, 0, 0, 0, 35, -84, 70, -20}}};
static const kmp_cam_piece modified_sine[] = {
    {0, 0.125, {0, MS_K *PI}, -MS_K / 4, MT_W, 0},
    {0.125, 0.875, {MS_K * (2 + PI / 8), MS_K *PI}, -9 * MS_K / 4, MT_W / 3, PI / 3},
    {0.875, 1, {MS_K * (4 + 7 * PI / 8), MS_K *PI}, -MS_K / 4, MT_W, 0}};
static const kmp_cam_piece modified_trapezoid[] = {
    {0, 0.125, {0, MT_V1}, -MT_A / (MT_W * MT_W), MT_W, 0},
    {0.125, 0.375, {MT_S1, MT_V1, MT_A / 2}, 0, 0, 0},
    /* a cos(4 pi (x - 3/8)) = -a sin(4 pi x - pi) */
    {0.375, 0.625, {MT_S2 + MT_A / (MT_W * MT_W), MT_V2}, MT_A / (MT_W * MT_W), MT_W, 0},
    {0.625, 0.875, {MT_S3, MT_V2, -MT_A / 2}, 0, 0, 0},
    {0.875, 1, {1 - 0.125 * MT_V1, MT_V1}, -MT_A / (MT_W * MT_W), MT_W, 0}};

const kmp_cam_piece *kmp_cam_pieces(kmp_cam_law_kind law, int *count)
{
    static const struct {
        const kmp_cam_piece *pieces;
        int count;
    } laws[KMP_CAM_LAWS] = {
#define KMP_CAM_LAW(kind, word, ...) {word, (int)(sizeof word / sizeof *word)},
#include "model/data/cam_laws.def"
#undef KMP_CAM_LAW
    };
    *count = laws[law].count;
    return laws[law].pieces;
}

/* -- formulas of numbers --------------------------------------------------------------------------------- */

typedef double value;
#define NUMBER(x)      ((void)g, (x))
#define ADD(a, b)      ((void)g, (a) + (b))
#define SUB(a, b)      ((void)g, (a) - (b))
#define MUL(a, b)      ((a) * (b))
#define DIV(a, b)      ((void)g, (a) / (b))
#define NEG(a)         (-(a))
#define ROOT(a)        sqrt(a)
#define SINE(a)        sin(a)
#define COSINE(a)      cos(a)
#define FLOOR(a)       floor(a)
#define DOT(a, b)      ((a)[0] * (b)[0] + (a)[1] * (b)[1])
#define CROSS(a, b)    ((a)[0] * (b)[1] - (a)[1] * (b)[0])
#define TURN(e, v, to) ((to)[0] = (e)[0] * (v)[0] - (e)[1] * (v)[1], (to)[1] = (e)[0] * (v)[1] + (e)[1] * (v)[0])
#include "model/data/cam_formulas.def"

static void table_at(kmp_graph *g, kmp_table *table, double x, double r[3])
{
    (void)g;
    for (int d = 0; d < 3; d++)
        r[d] = kmp_table_value(table, d, x);
}

static double lift_at(kmp_graph *g, const kmp_cam *cam, int derivative, double angle)
{
    (void)g;
    return kmp_cam_lift(cam, derivative, angle);
}

double kmp_cam_piece_value(const kmp_cam_piece *piece, int derivative, double x)
{
    return piece_at(NULL, piece, derivative, x);
}

double kmp_cam_law_value(kmp_cam_law_kind law, int derivative, double x)
{
    int count;
    const kmp_cam_piece *pieces = kmp_cam_pieces(law, &count);
    if (x < 0 || x > 1)
        return derivative == 0 && x > 1 ? 1 : 0;
    int k = 0;
    while (k + 1 < count && x >= pieces[k].to)
        k++;
    return kmp_cam_piece_value(&pieces[k], derivative, x);
}

void kmp_cam_free(kmp_cam *cam)
{
    for (int i = 0; cam && i < 2; i++)
        kmp_table_free(cam->place[i]);
}

/* From 0 to less than a turn. */
static double within_turn(double angle)
{
    const double rest = angle - KMP_TURN * floor(angle / KMP_TURN);
    return rest < KMP_TURN ? rest : 0;
}

double kmp_cam_lift(const kmp_cam *cam, int derivative, double angle)
{
    double lift = 0;
    angle = within_turn(angle);
    for (int k = 0; k < cam->part_count; k++) {
        const kmp_cam_part *part = &cam->parts[k];
        const double width = part->to - part->from;
        if (angle >= part->from && angle < part->to)
            lift += part->rise * kmp_cam_law_value(part->law, derivative, (angle - part->from) / width) /
                    pow(width, derivative);
        else if (angle >= part->to && derivative == 0)
            lift += part->rise;
    }
    return lift;
}

/* -- base curves ------------------------------------------------------------------------------------------- */

double kmp_cam_inset(const kmp_cam *cam)
{
    return cam->parts && cam->form == KMP_FOLLOWER_ROLLER ? cam->radius : 0;
}

/* The base curve's parameter at its beginning, and its range. */
static void range_of(const kmp_cam *cam, double *first, double *whole)
{
    const kmp_table *length = cam->place[0];
    *first = length ? length->x[0] : 0;
    *whole = length ? length->x[length->count - 1] - *first : KMP_TURN;
}

/* At a part of the whole from 0 to 1, which may be outside. */
static curve_place place_at(const kmp_cam *cam, double part)
{
    double first, whole;
    range_of(cam, &first, &whole);
    return curve_at(NULL, cam, first + part * whole);
}

void kmp_outline_place(const kmp_outline *outline, int k, int count, double place[2])
{
    const kmp_cam *cam = outline->cam;
    if (!cam) {
        const kmp_piece *circle = &outline->pieces[0];
        place[0] = circle->centre[0] + circle->radius * cos(KMP_TURN * k / count);
        place[1] = circle->centre[1] + circle->radius * sin(KMP_TURN * k / count);
        return;
    }
    const curve_place at = place_at(cam, (double)k / count);
    for (int i = 0; i < 2; i++)
        place[i] = at.c[i] - kmp_cam_inset(cam) * at.n[i];
}

/* -- paths -------------------------------------------------------------------------------------------------- */

bool kmp_cam_is_exact(const kmp_cam *cam, const kmp_cam_follower *follower)
{
    return cam->parts && cam->form == follower->form && !(follower->leaves && (cam->arm != 0 || cam->offset != 0)) &&
           (follower->form != KMP_FOLLOWER_ROLLER || cam->radius == follower->radius);
}

/* A place of the path: its angle and its distance. */
static void path_place(const kmp_cam *cam, const kmp_cam_follower *follower, double part, double *angle, double *size)
{
    const curve_place at = place_at(cam, part);
    const double d = follower->radius - kmp_cam_inset(cam);
    if (follower->form == KMP_FOLLOWER_FLAT) {
        *angle = atan2(at.n[1], at.n[0]);
        *size = at.c[0] * at.n[0] + at.c[1] * at.n[1] + d;
        return;
    }
    const double p[2] = {at.c[0] + d * at.n[0], at.c[1] + d * at.n[1]};
    *angle = atan2(p[1], p[0]);
    *size = hypot(p[0], p[1]);
}

/* The angle less a turn or more, so that it is less than half a turn from another one. */
static double near_to(double angle, double other)
{
    return angle - KMP_TURN * floor((angle - other + PI) / KMP_TURN);
}

/* The part of the whole at which the angle is half a turn. */
static double part_behind(const kmp_cam *cam, const kmp_cam_follower *follower)
{
    double angle, size, low = 0;
    path_place(cam, follower, 0, &angle, &size);
    const double first = angle;
    double step = 1.0 / PLACES;
    /* the last place before it, then halves of the distance */
    while (low + step < 1) {
        path_place(cam, follower, low + step, &angle, &size);
        if (first + within_turn(angle - first) >= PI)
            break;
        low += step;
    }
    for (int k = 0; k < 60; k++) {
        step /= 2;
        path_place(cam, follower, low + step, &angle, &size);
        if (near_to(angle, PI) < PI)
            low += step;
    }
    return low;
}

kmp_table *kmp_cam_parameter(const kmp_cam *cam, const kmp_cam_follower *follower, kmp_cam_check *fault)
{
    double *x = KMP_NEW(double, 2 * (PLACES + 1)), size, first, whole;
    fault->fault = KMP_CAM_NO_MEMORY;
    if (!x)
        return NULL;
    double *u = x + PLACES + 1;
    const double begin = part_behind(cam, follower);
    bool good = true;
    range_of(cam, &first, &whole);
    for (int k = 0; k <= PLACES; k++) {
        const double part = begin + (double)k / PLACES;
        path_place(cam, follower, part, &x[k], &size);
        x[k] = k == 0 ? -PI : k == PLACES ? PI : near_to(x[k], x[k - 1]);
        u[k] = first + part * whole;
        if (good && k > 0 && !(x[k] > x[k - 1])) {
            good = false;
            *fault = (kmp_cam_check){.fault = KMP_CAM_NOT_ROUND, .angle = within_turn(x[k])};
        }
    }
    kmp_table *made = good ? kmp_table_new(KMP_TABLE_CUBIC, PLACES + 1, x, u) : NULL;
    if (made)
        fault->fault = KMP_CAM_GOOD;
    kmp_free(x);
    return made;
}

/* The distance between a place and the one that the search finds from its direction, in parts of the whole. */
static double search_error(const kmp_cam *cam, const kmp_cam_follower *follower, const kmp_table *begins, double part)
{
    double angle, size, first, whole;
    path_place(cam, follower, part, &angle, &size);
    range_of(cam, &first, &whole);
    const double e[2] = {cos(angle), sin(angle)};
    double found = (kmp_table_value(begins, 0, angle) - first) / whole;
    for (int i = 0; i < KMP_CAM_STEPS; i++) {
        const curve_place at = place_at(cam, found);
        found -= step_from(NULL, follower, &at, e) / whole;
    }
    const double off = found - part;
    return fabs(off - floor(off + 0.5));
}

/* The search between its nodes, and between the places of a table, each at several places. */
static kmp_cam_check check_search(const kmp_cam *cam, const kmp_cam_follower *follower)
{
    enum { BETWEEN = 4 };
    kmp_cam_check worst = {.fault = KMP_CAM_GOOD};
    kmp_table *begins = kmp_cam_parameter(cam, follower, &worst);
    const kmp_table *given = cam->place[0] ? cam->place[0] : cam->table;
    const int all = BETWEEN * (PLACES + (given ? given->count - 1 : 0));
    for (int k = 0; begins && k < all; k++) {
        const int interval = k / BETWEEN, node = interval - PLACES;
        const double within = (k % BETWEEN + 0.5) / BETWEEN;
        double part = (interval + within) / PLACES, angle, size;
        if (node >= 0)
            part = (given->x[node] + within * (given->x[node + 1] - given->x[node]) - (cam->table ? 0 : given->x[0])) /
                   (given->x[given->count - 1] - given->x[0]);
        const double off = search_error(cam, follower, begins, part);
        if (off <= worst.off)
            continue;
        path_place(cam, follower, part, &angle, &size);
        worst = (kmp_cam_check){off <= KMP_CAM_FOUND ? KMP_CAM_GOOD : KMP_CAM_NOT_FOUND, within_turn(angle),
                                place_at(cam, part).k, off};
        if (!(off <= 1))
            break;
    }
    kmp_table_free(begins);
    return worst;
}

kmp_cam_check kmp_cam_find_fault(const kmp_cam *cam, const kmp_cam_follower *follower)
{
    const double inset = kmp_cam_inset(cam), d = follower->radius - inset;
    double before = 0, angle, size;
    for (int k = 0; k <= PLACES; k++) {
        const curve_place at = place_at(cam, (double)k / PLACES);
        kmp_cam_check found = {KMP_CAM_GOOD, within_turn(atan2(at.c[1], at.c[0])), at.k / (1 - inset * at.k), 0};
        path_place(cam, follower, (double)k / PLACES, &angle, &size);
        if (!(isfinite(at.k) && 1 - inset * at.k > 0) || (cam->parts && cam->form == KMP_FOLLOWER_FLAT && at.k <= 0))
            found.fault = KMP_CAM_UNDERCUT;
        else if (follower->form == KMP_FOLLOWER_FLAT && !(at.k > 0))
            found.fault = KMP_CAM_NOT_FLAT;
        else if (!(1 + d * at.k > 0))
            found.fault = KMP_CAM_HOLLOW;
        else if (k > 0 && !(near_to(angle, before) > before))
            found.fault = KMP_CAM_NOT_ROUND;
        if (found.fault)
            return found;
        before = angle;
    }
    return kmp_cam_is_exact(cam, follower) ? (kmp_cam_check){.fault = KMP_CAM_GOOD} : check_search(cam, follower);
}

bool kmp_cam_is_hollow(const kmp_cam *cam, kmp_cam_check *place)
{
    *place = (kmp_cam_check){.fault = KMP_CAM_GOOD};
    for (int k = 0; k < PLACES; k++) {
        const curve_place at = place_at(cam, (double)k / PLACES);
        const double curvature = at.k / (1 - kmp_cam_inset(cam) * at.k);
        if (curvature < place->curvature)
            *place = (kmp_cam_check){KMP_CAM_HOLLOW, within_turn(atan2(at.c[1], at.c[0])), curvature, 0};
    }
    return place->curvature < 0;
}

void kmp_cam_path_place(const kmp_cam *cam, const kmp_cam_follower *follower, int k, int count, double place[2])
{
    double angle, size;
    path_place(cam, follower, (double)k / count, &angle, &size);
    place[0] = size * cos(angle);
    place[1] = size * sin(angle);
}

bool kmp_outline_is_smooth(const kmp_outline *outline)
{
    return outline->cam || (outline->shape == KMP_OUTLINE_CIRCLE && !outline->hollow && outline->copies == 1);
}
