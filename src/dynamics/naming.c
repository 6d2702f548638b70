/* SPDX-License-Identifier: BSD-3-Clause */
/* Numbers in parentheses are equations of Fisette and Samin 1996. */
#include "dynamics/naming.h"

const kmp_notion kmp_name_rate = {"OM", "angular velocity, (11)"};
const kmp_notion kmp_name_acceleration = {"OMp", "angular acceleration, (12)"};
const kmp_notion kmp_name_beta = {"BS", "angular acceleration and centripetal terms as a matrix, (13)"};
const kmp_notion kmp_name_linear = {"AlF", "acceleration of the origin less gravity, (14)"};
const kmp_notion kmp_name_force = {"FF", "force of the joint, (25)"};
const kmp_notion kmp_name_moment = {"CF", "moment of the joint, (27)"};
const kmp_notion kmp_name_column_rate = {"OpM", "angular acceleration per qdd, (22)"};
const kmp_notion kmp_name_column_linear = {"AlM", "acceleration of the origin per qdd, (23)"};
const kmp_notion kmp_name_column_force = {"FM", "force of the joint per qdd, (35)"};
const kmp_notion kmp_name_column_moment = {"CM", "moment of the joint per qdd, (36)"};
const kmp_notion kmp_name_mass = {"mC", "mass of what the joint carries"};
const kmp_notion kmp_name_first = {"lC", "first moment of what the joint carries"};
const kmp_notion kmp_name_second = {"IC", "inertia of what the joint carries about its origin"};

void kmp_name_entry(kmp_graph *g, const kmp_notion *quantity, kmp_ref r, int entry, int link, int column)
{
    kmp_graph_label(g, r, (kmp_label){.quantity = quantity, .entry = entry, .link = link, .column = column});
}

void kmp_name_vector(kmp_graph *g, const kmp_notion *quantity, kmp_vec v, int link, int column)
{
    for (int k = 0; k < 3 && kmp_graph_has_labels(g); k++)
        kmp_name_entry(g, quantity, v.x[k], k + 1, link, column);
}
