/* SPDX-License-Identifier: BSD-3-Clause */
/* Laws that mean less than they seem to say. */
#pragma once

#include "model/data/model.h"

/** Warns of friction that sticks whose level jumps with the direction of a rate: at rest one level holds both ways. */
void kmp_warn_of_directions(const kempe_model *model);

/** Warns of reactions, as outputs and in friction by `mu`, of joints that a coupler moves: it has no force in space. */
void kmp_warn_of_couplers(const kempe_model *model);

/** Warns of friction by the reaction of a joint, or of a closure, that a force across the plane of a plane mechanism
 * may press: closures carry nothing across it. */
void kmp_warn_of_planes(const kempe_model *model);

/** Warns of implicit variables whose equations have kinks, which are not located. */
void kmp_warn_of_implicit_kinks(const kempe_model *model);
