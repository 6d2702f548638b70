/* SPDX-License-Identifier: BSD-3-Clause */
/* Bending follows from the curvature of the shapes at a station, N from the lengthening of the axis between the
 * neighbouring stations: without axial shapes it is zero. Places between stations of the curve have the stress between
 * theirs. */
#include "picture/beam_stress.h"
#include "model/data/body.h"
#include "model/data/flexible.h"
#include <math.h>

static int number_of(const kempe_model *model, int body)
{
    return kmp_model_body(model, body)->flexible - 1;
}

/* The sections at the places of its curve. */
static const kmp_drawn_section *sections_of(const kmp_drawing *drawing, const kempe_model *model, int body)
{
    return &drawing->sections[number_of(model, body) * (KMP_BEAM_PIECES + 1)];
}

bool kmp_drawing_has_edges(const kmp_drawing *drawing, const kempe_model *model, int body)
{
    return number_of(model, body) >= 0 && sections_of(drawing, model, body)->edge[0] > 0;
}

bool kmp_drawing_lengthens(const kmp_drawing *drawing, const kempe_model *model, int body)
{
    return kmp_drawing_has_edges(drawing, model, body) && sections_of(drawing, model, body)->lengthens;
}

/* Row c of three, times the body's coordinates. */
static double row_product(const kempe_model *model, int body, const kmp_number *row, int c, const double *q)
{
    const kmp_flexible *flexible = kmp_model_flexible(model, number_of(model, body));
    double sum = 0;
    for (int k = 0; k < flexible->count; k++)
        sum += row[c * flexible->count + k].value * q[flexible->first + k];
    return sum;
}

/* At the farthest corner of a rectangle, or on the circle. */
static double bending_stress(const kmp_drawn_section *section, double about_y, double about_z)
{
    const double about[2] = {about_z, about_y};
    double by[2];
    for (int k = 0; k < 2; k++) /* a sharp end of a taper has neither */
        by[k] = section->about[k] > 0 ? fabs(about[k]) / section->about[k] * section->edge[k] / 2 : 0;
    return section->round ? hypot(by[0], by[1]) : by[0] + by[1];
}

/* Of a place on the curve; the places of the curve are next to it in the list. */
static double stress_on_curve(const kmp_drawn_section *section, const kempe_model *model, const kmp_drawn_place *place,
                              const double *q)
{
    const kmp_drawn_place *before = place->along > 0 ? place - 1 : place;
    const kmp_drawn_place *behind = place->along < KMP_BEAM_PIECES ? place + 1 : place;
    const double longer = row_product(model, place->body, behind->station->shift, 0, q) -
                          row_product(model, place->body, before->station->shift, 0, q);
    const double apart = section->length * (behind->along - before->along) / KMP_BEAM_PIECES;
    return fabs(section->young * longer / apart) +
           bending_stress(section, row_product(model, place->body, place->station->strained, 1, q),
                          row_product(model, place->body, place->station->strained, 2, q));
}

/* Between the places of the curve, the first of which has the first of `stress`. */
static double stress_between(const kmp_drawn_section *section, const kmp_drawn_place *place, const double *stress)
{
    const double at = place->station->at[0].value / section->length * KMP_BEAM_PIECES;
    const int first = (int)fmin(fmax(floor(at), 0), KMP_BEAM_PIECES - 1);
    return stress[first] + (at - first) * (stress[first + 1] - stress[first]);
}

void kmp_drawing_stress(const kmp_drawing *drawing, const kempe_model *model, const double *q, double *stress)
{
    for (int k = 0; k < drawing->place_count; k++) {
        const kmp_drawn_place *place = &drawing->places[k];
        const bool known = kmp_drawing_has_edges(drawing, model, place->body);
        stress[k] = known && place->along >= 0
                        ? stress_on_curve(&sections_of(drawing, model, place->body)[place->along], model, place, q)
                        : -1;
    }
    for (int k = 0; k < drawing->place_count; k++) {
        const kmp_drawn_place *place = &drawing->places[k];
        const bool off_axis = fabs(place->offset[0]) + fabs(place->offset[1]) + fabs(place->offset[2]) > 0;
        if (place->along >= 0 || off_axis || !kmp_drawing_has_edges(drawing, model, place->body))
            continue;
        int first = 0;
        while (drawing->places[first].body != place->body || drawing->places[first].along != 0)
            first++;
        stress[k] = stress_between(sections_of(drawing, model, place->body), place, &stress[first]);
    }
}
