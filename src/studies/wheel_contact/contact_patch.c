/* SPDX-License-Identifier: BSD-3-Clause */
/* A contact of the table: its values in the model, its rolling radius, and forces by another law. */
#include "studies/wheel_contact/contact_sweep.h"
#include "symbolic/table_function.h"
#include <kempe/contact.h>
#include <kempe/vehicle.h>
#include <math.h>

/* Largest relative difference of the curvature at the contact from that of the patch, which is an average. Below it the
 * gap is a parabola except for the profile's arcs at its borders. In the benchmark of Manchester it is 3.5 % at most
 * for patches that are one ellipse, 9 % at least for others (examples/manchester). */
#define ROUND_ABOUT 0.05

void kmp_contact_patch(const kempe_contacts *t, int wheel, const double *shown, kempe_contact_patch *p)
{
    const kempe_model *model = t->system->model;
    const kmp_wheel *w = &model->wheels[wheel];
    bool touches = shown[3] > 0;
    *p = (kempe_contact_patch){.touches = touches,
                               .s = shown[0],
                               .y = shown[1],
                               .angle = shown[2],
                               .normal = shown[3],
                               .slip = {shown[4], shown[5]},
                               .spin = shown[6],
                               .force = {shown[7], shown[8]},
                               .moment = shown[9],
                               .a = touches ? shown[10] : NAN,
                               .b = touches ? shown[11] : NAN,
                               .one_ellipse = w->form == KMP_CONTACT_RIGID || !touches ? -1
                                              : fabs(shown[12] - 1) <= ROUND_ABOUT     ? 1
                                                                                       : 0,
                               .pressure = NAN,
                               .area = NAN,
                               .approach = NAN};
    p->radius = w->radius.value - kmp_table_value(w->profile->height, 0, p->s);
    kempe_creep creep = {.a = p->a,
                         .b = p->b,
                         .shear_modulus = w->shear_modulus.value,
                         .poisson = w->poisson,
                         .normal = p->normal,
                         .friction = w->friction.value,
                         .slip = {p->slip[0], p->slip[1]},
                         .spin = p->spin};
    kempe_creep_force force = {{0, 0}, 0, 0};
    bool known = !p->touches || t->rolls || kempe_contact_creep(t->law, &creep, &force) == KEMPE_OK;
    for (int k = 0; k < 2; k++)
        p->by_law[k] = t->has_law && known && !t->rolls ? force.force[k] : NAN;
}
