# SPDX-License-Identifier: BSD-3-Clause
"""The recipe of Conan. packaging/release fills in the address and the SHA-256 of the source archive."""
from conan import ConanFile
from conan.tools.cmake import CMake, CMakeDeps, CMakeToolchain, cmake_layout
from conan.tools.files import copy, get, rmdir

required_conan_version = ">=2.0"


class Kempe(ConanFile):
    name = "kempe"
    version = "@VERSION@"
    description = "Simulation of mechanisms with closed kinematic loops"
    license = "BSD-3-Clause AND BSD-2-Clause AND MIT"
    topics = ("multibody", "mechanism", "simulation")
    package_type = "library"
    settings = "os", "compiler", "build_type", "arch"
    options = {"shared": [True, False], "command": [True, False], "nlopt": [True, False]}
    default_options = {"shared": False, "command": False, "nlopt": True}

    def layout(self):
        cmake_layout(self, src_folder="src")

    def requirements(self):
        for package in ("expat/[>=2.6 <3]", "libyaml/0.2.5", "openblas/[>=0.3.20 <1]", "suitesparse-klu/[>=2 <3]", "sundials/[>=6 <8]"):
            self.requires(package)
        if self.options.nlopt:
            self.requires("nlopt/[>=2.7 <3]")

    def configure(self):
        self.settings.rm_safe("compiler.cppstd")
        self.settings.rm_safe("compiler.libcxx")

    def source(self):
        get(self, url="@URL@", sha256="@SHA256@", strip_root=True)

    def generate(self):
        toolchain = CMakeToolchain(self)
        for name, value in {"KEMPE_TESTS": False, "KEMPE_UNITS": False, "KEMPE_INSTALL": True, "KEMPE_UMFPACK": False, "KEMPE_CMINPACK": False,
                            "KEMPE_WORKBENCH": False,  # it loads a shared libmicrohttpd when it starts
                            "KEMPE_COMMAND": bool(self.options.command), "KEMPE_NLOPT": bool(self.options.nlopt)}.items():
            toolchain.cache_variables[name] = value
        toolchain.generate()
        CMakeDeps(self).generate()

    def build(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.build()

    def package(self):
        copy(self, "LICENSE*", self.source_folder, self.package_folder + "/licenses")
        copy(self, "*/LICENSE.txt", self.source_folder + "/third_party", self.package_folder + "/licenses")
        CMake(self).install()
        rmdir(self, self.package_folder + "/lib/cmake")
        rmdir(self, self.package_folder + "/lib/pkgconfig")
        rmdir(self, self.package_folder + "/share")

    def package_info(self):
        self.cpp_info.libs = ["kempe"]
        self.cpp_info.set_property("cmake_file_name", "Kempe")
        self.cpp_info.set_property("cmake_target_name", "Kempe::kempe")
        if self.settings.os in ("Linux", "FreeBSD"):
            self.cpp_info.system_libs = ["m", "pthread", "dl"]
