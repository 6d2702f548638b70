/* SPDX-License-Identifier: BSD-3-Clause */
/* Flexible bodies as matrices DMIG of Nastran's bulk data, a text: stiffness and mass of a free body reduced to
 * interface grid points with six components each, and scalar points. */
#pragma once

#include "model/flexible/modal_file.h"

bool kmp_dmig_modes_read(const kmp_modal_source *source);
