# SPDX-License-Identifier: BSD-3-Clause
# The formula of Homebrew. packaging/release fills in the address and the SHA-256 of the source archive.
class Kempe < Formula
  desc "Simulation of mechanisms with closed kinematic loops"
  homepage "@HOMEPAGE@"
  url "@URL@"
  sha256 "@SHA256@"
  license all_of: ["BSD-3-Clause", "BSD-2-Clause", "MIT"]

  depends_on "cmake" => :build
  depends_on "ninja" => :build
  depends_on "cminpack"
  depends_on "expat"
  depends_on "libmicrohttpd"
  depends_on "libyaml"
  depends_on "nlopt"
  depends_on "suite-sparse"
  depends_on "sundials"

  on_linux do
    depends_on "lapack"
  end

  def install
    system "cmake", "-G", "Ninja", "-S", ".", "-B", "build", "-DBUILD_SHARED_LIBS=ON", "-DKEMPE_TESTS=OFF", "-DKEMPE_UMFPACK=OFF", *std_cmake_args
    system "cmake", "--build", "build"
    system "cmake", "--install", "build"
  end

  test do
    system bin/"kempe", "new", "four_bar"
    assert_match "1 degree of freedom", shell_output("#{bin}/kempe check four_bar.yaml")
  end
end
