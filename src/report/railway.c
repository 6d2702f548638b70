/* SPDX-License-Identifier: BSD-3-Clause */
/* Rails are drawn over the range of the wheels, and a little more. */
#include "report/railway.h"
#include "symbolic/table_function.h"
#include <math.h>

enum { COURSE_POINTS = 400, LOOKED_AT = 200 };

static double axis_at(const kmp_point *point, int i, int k)
{
    return point->turned ? point->axes[i][k] : i == k;
}

static void put_disc(kmp_json *json, const kempe_model *model, const kmp_wheel *wheel)
{
    const kmp_point *point = &model->points[wheel->point];
    double at[3], axis[3];
    for (int i = 0; i < 3; i++) {
        at[i] = point->at[i].value;
        axis[i] = axis_at(point, i, 1);
    }
    kmp_json_put(json, "{ body %d", point->body);
    kmp_json_rounded_numbers(json, "at", 3, at, 7);
    kmp_json_rounded_numbers(json, "axis", 3, axis, 7);
    kmp_json_put(json, "radius %.7g }", wheel->radius.value);
}

/* -- rails ------------------------------------------------------------------------------------------- */

/* A place of the track in ground axes: x along, y left, z up from its beginning. */
static void on_ground(const kempe_model *model, const kmp_track *track, const double place[3], double out[3])
{
    const kmp_point *point = &model->points[track->point];
    for (int i = 0; i < 3; i++) {
        out[i] = point->at[i].value;
        for (int k = 0; k < 3; k++)
            out[i] += axis_at(point, i, k) * place[k];
    }
}

static void rail_place(const kmp_track *track, double left, double s, double place[3])
{
    double heading = track->curved ? atan2(kmp_table_value(track->y, 1, s), kmp_table_value(track->x, 1, s)) : 0;
    double cant = track->curved && track->cant ? kmp_table_value(track->cant, 0, s) : 0;
    place[0] = (track->curved ? kmp_table_value(track->x, 0, s) : s) - left * cos(cant) * sin(heading);
    place[1] = (track->curved ? kmp_table_value(track->y, 0, s) : 0) + left * cos(cant) * cos(heading);
    place[2] = left * sin(cant);
}

static double distance(const double a[3], const double b[3])
{
    return sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]));
}

/* True if a body with a wheel on the track comes near a place of the ground. */
static bool is_run_on(const kempe_model *model, int track, const kmp_travel *travel, const double at[3])
{
    int stride = 1 + travel->frames / LOOKED_AT;
    for (int w = 0; w < model->wheel_count; w++) {
        int body = model->points[model->wheels[w].point].body - 1;
        if (model->wheels[w].track != track || body < 0 || body >= travel->bodies)
            continue;
        for (int f = 0; f < travel->frames; f += stride)
            if (distance(travel->position + 3 * ((ptrdiff_t)f * travel->bodies + body), at) <
                2 * model->tracks[track].gauge + 4 * model->wheels[w].radius.value)
                return true;
    }
    return false;
}

/* The range of bodies with a wheel on a straight track along it. */
static void straight_range(const kempe_model *model, int track, const kmp_travel *travel, double range[2])
{
    const kmp_point *point = &model->points[model->tracks[track].point];
    for (int w = 0; w < model->wheel_count; w++) {
        int body = model->points[model->wheels[w].point].body - 1;
        double more = 3 * model->wheels[w].radius.value;
        if (model->wheels[w].track != track || body < 0 || body >= travel->bodies)
            continue;
        for (int f = 0; f < travel->frames; f++) {
            const double *at = travel->position + 3 * ((ptrdiff_t)f * travel->bodies + body);
            double along = 0;
            for (int i = 0; i < 3; i++)
                along += axis_at(point, i, 0) * (at[i] - point->at[i].value);
            range[0] = fmin(range[0], along - more);
            range[1] = fmax(range[1], along + more);
        }
    }
}

static void put_rail(kmp_json *json, const kempe_model *model, int number, const kmp_travel *travel, int side)
{
    const kmp_track *track = &model->tracks[number];
    double range[2] = {INFINITY, -INFINITY}, left = side == KMP_TRACK_LEFT ? track->rail_at : -track->rail_at;
    int points = track->curved ? COURSE_POINTS : 2;
    if (track->curved) {
        range[0] = -track->length / COURSE_POINTS;
        range[1] = track->length * (1 + 1.0 / COURSE_POINTS);
    } else
        straight_range(model, number, travel, range);
    kmp_json_array(json, NULL);
    for (int k = 0; k < points && range[0] < range[1]; k++) {
        double place[3], at[3];
        rail_place(track, left, range[0] + (range[1] - range[0]) * k / (points - 1), place);
        on_ground(model, track, place, at);
        if (!track->curved || is_run_on(model, number, travel, at))
            kmp_json_rounded_numbers(json, NULL, 3, at, 7);
    }
    kmp_json_end(json);
}

void kmp_railway_put(kmp_json *json, const kempe_model *model, const kmp_travel *travel)
{
    if (model->wheel_count == 0)
        return;
    kmp_json_array(json, "discs");
    for (int w = 0; w < model->wheel_count; w++)
        if (model->points[model->wheels[w].point].body <= travel->bodies)
            put_disc(json, model, &model->wheels[w]);
    kmp_json_put(json, "] rails [");
    for (int k = 0; k < model->track_count; k++)
        for (int side = 0; side < KMP_TRACK_SIDES; side++)
            put_rail(json, model, k, travel, side);
    kmp_json_end(json);
}
