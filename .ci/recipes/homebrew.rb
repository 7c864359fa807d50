# A formula for Homebrew; .ci/recipe fills in the release.
class Faceoff < Formula
  desc "Settle whether finite element codes agree"
  homepage "@HOMEPAGE@"
  url "@URL@"
  version "@VERSION@"
  sha256 "@SHA256@"
  license any_of: ["MIT", "Apache-2.0"]

  depends_on "rust" => :build

  def install
    system "cargo", "install", *std_cargo_args
    generate_completions_from_executable(bin/"faceoff", "completions", shells: [:bash, :zsh, :fish])
    system bin/"faceoff", "man", buildpath/"man"
    man1.install Dir[buildpath/"man/*.1"]
  end

  test do
    system bin/"faceoff", "solve", "one-zone", "--n", "4", "--quiet", "--out", "a.vtu"
    cp "a.vtu", "b.vtu"
    assert_match "agree", shell_output("#{bin}/faceoff compare a.vtu b.vtu")
  end
end
