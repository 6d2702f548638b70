/* SPDX-License-Identifier: BSD-3-Clause */
/* A contact of a wheel with its rail: geometry, slip and forces together, as expressions. */
#pragma once

#include "rail/wheel/laws.h"
#include "rail/wheel/patch.h"

typedef struct kmp_contact {
    kmp_patch patch;
    kmp_slip slip;
    kmp_ref lateral; /* of the patch, outwards from the middle of the track, displacement of its rail included */
    kmp_ref normal;  /* N, along the normal */
    kmp_creep_force creep;
    kmp_vec force;   /* on the wheel at patch.point, N along the normal left out */
    kmp_vec moment;  /* with it */
    kmp_vec pressed; /* N along the normal */
} kmp_contact;

/** Number k of its contacts (kmp_wheel_contacts). The graph fails when there is no memory. */
void kmp_wheel_contact(const kmp_tree *tree, const kmp_wheel *wheel, const kmp_wheel_pose *pose, int k,
                       kmp_contact *contact);

/** Numbers of a wheel on its rail. */
typedef struct kmp_guidance {
    kmp_ref load, lateral; /* Q down, Y outwards in the plane of the track, N: forces on the rail */
    kmp_ref wear;          /* |along creep_along| + |across creep_across|, N: energy for each metre, without spin */
} kmp_guidance;

/** Adds a contact. */
void kmp_guidance_add(const kmp_tree *tree, const kmp_wheel_pose *pose, const kmp_contact *contact, kmp_guidance *sum);

/** The values of a contact that outputs show (KMP_CONTACT_SHOWN values; names in model/data/output_table.c): place on
 * wheel and track, angle, N, creepages and spin. Then forces along and across, moment, semi-axes of the patch and its
 * fit to one ellipse (kmp_patch_fit). */
void kmp_contact_values(const kmp_tree *tree, const kmp_wheel *wheel, const kmp_wheel_pose *pose,
                        const kmp_contact *contact, kmp_ref *value);
