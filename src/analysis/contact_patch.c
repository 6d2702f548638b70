/* SPDX-License-Identifier: BSD-3-Clause */
/* What the profiles say of a place that touches: the rolling radius, Hertz's ellipse, and forces by another law. */
#include "analysis/contact.h"
#include "model/model.h"
#include "symbolic/table.h"
#include <math.h>

void kmp_contact_surface(const struct kmp_table *height, double s, double out[3])
{
    for (int k = 0; k < 3; k++)
        out[k] = kmp_table_value(height, k, s);
}

static double bend_of(const double surface[3])
{
    double length = sqrt(1 + surface[1] * surface[1]);
    return surface[2] / (length * length * length);
}

/* The wheel as a surface of revolution about the axle, the rail as its cross-section drawn along the track: the wheel's
 * normal meets the axle at r sqrt(1 + r'^2); across, both profiles' curvatures. */
static void take_ellipse(const kmp_wheel *wheel, const kmp_track *track, kempe_contact_patch *p)
{
    double w[3], g[3];
    kempe_ellipse ellipse;
    kmp_contact_surface(wheel->profile->height, p->s, w);
    kmp_contact_surface(track->rail, p->y, g);
    p->radius = wheel->radius.value - w[0];
    kempe_touch touch = {.along = 1 / (p->radius * sqrt(1 + w[1] * w[1])),
                         .across = bend_of(w) - bend_of(g),
                         .shear_modulus = wheel->shear_modulus.value,
                         .poisson = wheel->poisson};
    p->a = p->b = NAN;
    if (kempe_contact_hertz(&touch, p->normal, &ellipse) == KEMPE_OK) {
        p->a = ellipse.a;
        p->b = ellipse.b;
    }
}

static void take_law(const kempe_contact_table *t, const kmp_wheel *wheel, kempe_contact_patch *p)
{
    kempe_creep creep = {.a = p->a,
                         .b = p->b,
                         .shear_modulus = wheel->shear_modulus.value,
                         .poisson = wheel->poisson,
                         .normal = p->normal,
                         .friction = wheel->friction.value,
                         .slip = {p->slip[0], p->slip[1]},
                         .spin = p->spin};
    kempe_creep_force force = {{0, 0}, 0, 0};
    bool known = !p->touches || kempe_contact_creep(t->law, &creep, &force) == KEMPE_OK;
    for (int k = 0; k < 2; k++)
        p->by_law[k] = t->has_law && known ? force.force[k] : NAN;
}

void kmp_contact_patch(const kempe_contact_table *t, int wheel, const double *shown, kempe_contact_patch *p)
{
    const kempe_model *model = t->system->model;
    const kmp_wheel *w = &model->wheels[wheel];
    *p = (kempe_contact_patch){.touches = shown[3] > 0,
                               .s = shown[0],
                               .y = shown[1],
                               .angle = shown[2],
                               .normal = shown[3],
                               .slip = {shown[4], shown[5]},
                               .spin = shown[6],
                               .force = {shown[7], shown[8]},
                               .moment = shown[9]};
    take_ellipse(w, &model->tracks[w->track], p);
    take_law(t, w, p);
}
