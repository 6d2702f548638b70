// SPDX-License-Identifier: BSD-3-Clause
// Accelerations of a tree by Simbody: forward_simbody TREE STATES SECONDS. Pins and sliders with bodies without mass
// between them; where the first body is free also with its six motions as one mobilizer (Bushing: angles about x, y, z,
// then places, which is the same motion in another order).
#include "simbody_tree.h"

int main(int argc, char **argv)
{
    if (argc < 4)
        return 2;
    Tree tree = read_tree(argv[1]);
    std::vector<State> states = read_states(argv[2], tree.n);
    double seconds = std::atof(argv[3]);
    for (int native = 0; native < (is_free(tree.bodies[0]) ? 2 : 1); native++) {
        SimbodyTree model(tree, native);
        SimTK::State state = model.system.realizeTopology();
        model.system.realizeModel(state);
        std::vector<int> order; // of Simbody's coordinates
        for (int k = 0; k < tree.n; k++)
            order.push_back(native && k < 6 ? (k + 3) % 6 : k);
        // Rates of the coordinates as Simbody's u, made ready before the clock runs.
        std::vector<SimTK::Vector> us;
        for (const State &s : states) {
            SimTK::Vector qdot(tree.n), u(tree.n);
            for (int k = 0; k < tree.n; k++) {
                state.updQ()[order[static_cast<size_t>(k)]] = s.q[static_cast<size_t>(k)];
                qdot[order[static_cast<size_t>(k)]] = s.qd[static_cast<size_t>(k)];
            }
            model.system.realize(state, SimTK::Stage::Position);
            model.matter.multiplyByNInv(state, false, qdot, u);
            us.push_back(u);
        }
        report(native ? "Simbody realize(Acceleration), six motions as one"
                      : "Simbody realize(Acceleration), pins and sliders",
               states, seconds, 0, [&](const State &s, std::vector<double> &qdd) {
                   SimTK::Vector &q = state.updQ();
                   for (size_t k = 0; k < order.size(); k++)
                       q[order[k]] = s.q[k];
                   state.updU() = us[static_cast<size_t>(&s - states.data())];
                   model.system.realize(state, SimTK::Stage::Acceleration);
                   const SimTK::Vector &a = state.getQDotDot();
                   qdd.resize(order.size());
                   for (size_t k = 0; k < order.size(); k++)
                       qdd[k] = a[order[k]];
               });
    }
    return 0;
}
