// SPDX-License-Identifier: BSD-3-Clause
// A mechanism with closed loops by Simbody: closed_simbody TREE T_END merson|feldberg|cpodes ACCURACY ... A line
// an accuracy: it, seconds of a run (median), q at the end.
#include "simbody_tree.h"
#include <cstring>
#include <memory>

static std::unique_ptr<SimTK::Integrator> make(const char *name, const SimTK::System &system)
{
    if (std::strcmp(name, "merson") == 0)
        return std::unique_ptr<SimTK::Integrator>(new SimTK::RungeKuttaMersonIntegrator(system));
    if (std::strcmp(name, "feldberg") == 0)
        return std::unique_ptr<SimTK::Integrator>(new SimTK::RungeKuttaFeldbergIntegrator(system));
    return std::unique_ptr<SimTK::Integrator>(
        new SimTK::CPodesIntegrator(system, SimTK::CPodes::BDF, SimTK::CPodes::Newton));
}

int main(int argc, char **argv)
{
    if (argc < 5)
        return 2;
    Tree tree = read_tree(argv[1]);
    double end = std::atof(argv[2]);
    SimbodyTree model(tree, false);
    SimTK::State start = model.system.realizeTopology();
    model.system.realizeModel(start);
    for (int k = 0; k < tree.n; k++) {
        start.updQ()[k] = tree.q[static_cast<size_t>(k)];
        start.updU()[k] = tree.qd[static_cast<size_t>(k)];
    }
    for (int k = 4; k < argc; k++) {
        std::vector<double> seconds;
        SimTK::Vector q;
        bool ok = true;
        for (double spent = 0; ok && seconds.size() < 5 && spent < 1; spent += seconds.back()) {
            auto integrator = make(argv[3], model.system);
            integrator->setAccuracy(std::atof(argv[k]));
            integrator->setInternalStepLimit(3000000);
            double begin = cpu_now();
            try {
                SimTK::TimeStepper stepper(model.system, *integrator);
                stepper.initialize(start);
                stepper.stepTo(end);
                q = integrator->getState().getQ();
            } catch (const std::exception &) {
                ok = false;
            }
            seconds.push_back(cpu_now() - begin);
        }
        std::sort(seconds.begin(), seconds.end());
        std::printf("%s %.6g", argv[k], seconds[seconds.size() / 2]);
        for (int i = 0; ok && i < tree.n; i++)
            std::printf(" %.17g", q[i]);
        std::printf("\n");
        std::fflush(stdout);
    }
    return 0;
}
