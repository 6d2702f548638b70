/* SPDX-License-Identifier: BSD-3-Clause */
#include "rail/wheel/wheel_outputs.h"
#include "dynamics/equations.h"
#include "model/data/model.h"
#include "rail/wheel/wheel_contact.h"

/* The values of each contact of a wheel, or the sums that guide it; Y/Q is zero where no load is. */
static void show_contacts(kmp_equations *eq, const kmp_output *output)
{
    const bool sums = output->kind == KMP_OUTPUT_GUIDANCE;
    const kmp_wheel *wheel = &eq->model->wheels[output->index];
    kmp_graph *g = eq->graph;
    kmp_guidance sum = {KMP_ZERO, KMP_ZERO, KMP_ZERO};
    kmp_wheel_pose pose;
    kmp_wheel_find(&eq->tree, wheel, &pose);
    for (int k = 0; k < kmp_wheel_contacts(wheel); k++) {
        kmp_contact contact;
        kmp_wheel_contact(&eq->tree, wheel, &pose, k, &contact);
        if (sums) {
            kmp_guidance_add(&eq->tree, &pose, &contact, &sum);
            continue;
        }
        kmp_contact_values(&eq->tree, wheel, &pose, &contact, eq->shown + eq->shown_count);
        eq->shown_count += KMP_CONTACT_SHOWN;
    }
    if (!sums)
        return;
    const kmp_ref loaded = kmp_less(g, KMP_ZERO, sum.load), load = kmp_select(g, loaded, sum.load, KMP_ONE);
    const kmp_ref shown[] = {sum.load, sum.lateral, kmp_select(g, loaded, kmp_div(g, sum.lateral, load), KMP_ZERO),
                             sum.wear};
    for (size_t k = 0; k < sizeof shown / sizeof *shown; k++)
        eq->shown[eq->shown_count++] = shown[k];
}

static void show_pose(kmp_equations *eq, const kmp_output *output)
{
    kmp_wheel_pose pose;
    kmp_wheel_find(&eq->tree, &eq->model->wheels[output->index], &pose);
    const kmp_ref shown[KMP_POSE_SHOWN] = {pose.out, pose.up, pose.axle[0], pose.axle[1], pose.axle[2]};
    for (int k = 0; k < KMP_POSE_SHOWN; k++)
        eq->shown[eq->shown_count++] = shown[k];
}

const kmp_output_of_wing kmp_wheel_outputs[] = {
    {KMP_OUTPUT_CONTACT, show_contacts}, {KMP_OUTPUT_GUIDANCE, show_contacts}, {KMP_OUTPUT_POSE, show_pose}, {0}};
