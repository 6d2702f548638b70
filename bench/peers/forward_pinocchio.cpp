// SPDX-License-Identifier: BSD-3-Clause
// Accelerations of a tree by Pinocchio's articulated body algorithm, in both its conventions: forward_pinocchio TREE
// STATES SECONDS. As a chain of elementary joints with bodies without mass between them; where the first body is free
// also with its six motions as one joint (FreeFlyer), whose coordinates are others: its own accelerations are left out
// there.
#include "tree.h"
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/multibody.hpp>

namespace pin = pinocchio;

static pin::JointIndex add(pin::Model &model, pin::JointIndex parent, const TreeMotion &m, const pin::SE3 &place,
                           const std::string &name)
{
    Eigen::Vector3d axis(m.axis[0], m.axis[1], m.axis[2]);
    if (axis == Eigen::Vector3d::UnitX())
        return m.turns ? model.addJoint(parent, pin::JointModelRX(), place, name)
                       : model.addJoint(parent, pin::JointModelPX(), place, name);
    if (axis == Eigen::Vector3d::UnitY())
        return m.turns ? model.addJoint(parent, pin::JointModelRY(), place, name)
                       : model.addJoint(parent, pin::JointModelPY(), place, name);
    if (axis == Eigen::Vector3d::UnitZ())
        return m.turns ? model.addJoint(parent, pin::JointModelRZ(), place, name)
                       : model.addJoint(parent, pin::JointModelPZ(), place, name);
    return m.turns ? model.addJoint(parent, pin::JointModelRevoluteUnaligned(axis), place, name)
                   : model.addJoint(parent, pin::JointModelPrismaticUnaligned(axis), place, name);
}

static pin::Model build(const Tree &tree, bool native)
{
    pin::Model model;
    std::vector<pin::JointIndex> joint;
    model.gravity.linear() << tree.gravity[0], tree.gravity[1], tree.gravity[2];
    for (const TreeBody &b : tree.bodies) {
        pin::JointIndex last = b.parent < 0 ? 0 : joint[static_cast<size_t>(b.parent)];
        pin::SE3 place(Eigen::Matrix3d::Identity(), Eigen::Vector3d(b.at[0], b.at[1], b.at[2]));
        if (native && is_free(b))
            last = model.addJoint(last, pin::JointModelFreeFlyer(), place, b.name);
        else
            for (size_t k = 0; k < b.motions.size(); k++) {
                last = add(model, last, b.motions[k], place, b.name + "." + std::to_string(k));
                place.setIdentity();
            }
        const auto &i = b.inertia;
        Eigen::Matrix3d about;
        about << i[0], i[3], i[4], i[3], i[1], i[5], i[4], i[5], i[2];
        model.appendBodyToJoint(last, pin::Inertia(b.mass, Eigen::Vector3d(b.com[0], b.com[1], b.com[2]), about),
                                pin::SE3::Identity());
        joint.push_back(last);
    }
    return model;
}

int main(int argc, char **argv)
{
    if (argc < 4)
        return 2;
    Tree tree = read_tree(argv[1]);
    std::vector<State> states = read_states(argv[2], tree.n);
    double seconds = std::atof(argv[3]);
    size_t n = static_cast<size_t>(tree.n);
    for (int native = 0; native < (is_free(tree.bodies[0]) ? 2 : 1); native++) {
        pin::Model model = build(tree, native);
        pin::Data data(model);
        Eigen::VectorXd q(model.nq), v(model.nv), tau = Eigen::VectorXd::Zero(model.nv);
        // The states in the other coordinates are prepared before the clock runs.
        std::vector<Eigen::VectorXd> qs, vs;
        for (const State &s : states) {
            if (native) {
                Eigen::Matrix3d x = Eigen::AngleAxisd(s.q[3], Eigen::Vector3d::UnitX()).matrix(),
                                y = Eigen::AngleAxisd(s.q[4], Eigen::Vector3d::UnitY()).matrix(),
                                z = Eigen::AngleAxisd(s.q[5], Eigen::Vector3d::UnitZ()).matrix();
                Eigen::Matrix3d turned = x * y * z;
                Eigen::Vector3d rate = Eigen::Vector3d::UnitX() * s.qd[3] + x * Eigen::Vector3d::UnitY() * s.qd[4] +
                                       x * y * Eigen::Vector3d::UnitZ() * s.qd[5];
                Eigen::Quaterniond p(turned);
                q.head<3>() << s.q[0], s.q[1], s.q[2];
                q.segment<4>(3) << p.x(), p.y(), p.z(), p.w();
                v.head<3>() = turned.transpose() * Eigen::Vector3d(s.qd[0], s.qd[1], s.qd[2]);
                v.segment<3>(3) = turned.transpose() * rate;
                q.tail(model.nq - 7) = Eigen::Map<const Eigen::VectorXd>(s.q.data() + 6, model.nq - 7);
                v.tail(model.nv - 6) = Eigen::Map<const Eigen::VectorXd>(s.qd.data() + 6, model.nv - 6);
            } else {
                q = Eigen::Map<const Eigen::VectorXd>(s.q.data(), tree.n);
                v = Eigen::Map<const Eigen::VectorXd>(s.qd.data(), tree.n);
            }
            qs.push_back(q);
            vs.push_back(v);
        }
        for (pin::Convention convention : {pin::Convention::LOCAL, pin::Convention::WORLD}) {
            std::string name = std::string("Pinocchio ABA, ") +
                               (convention == pin::Convention::LOCAL ? "local" : "world") +
                               (native ? ", free flyer" : ", elementary joints");
            report(name.c_str(), states, seconds, native ? 6 : 0, [&](const State &s, std::vector<double> &qdd) {
                size_t k = static_cast<size_t>(&s - states.data());
                const auto &a = pin::aba(model, data, qs[k], vs[k], tau, convention);
                qdd.assign(a.data(), a.data() + n);
            });
        }
    }
    return 0;
}
