# Writes the bytes of a file as a C++ array: cmake -D IN=FILE -D OUT=FILE.cc -P embed.cmake
file(READ ${IN} hex HEX)
string(REGEX REPLACE "(..)" "0x\\1," bytes "${hex}")
string(REGEX REPLACE "(................................................................................)" "\\1\n" bytes "${bytes}")
file(WRITE ${OUT} "// Declared in server/web/comments.h.\n#include <cstddef>\n\nnamespace strata::server::web {\n\n"
                  "extern const unsigned char kContractBytes[];\nextern const std::size_t kContractSize;\n\n"
                  "const unsigned char kContractBytes[] = {\n${bytes}\n};\n"
                  "const std::size_t kContractSize = sizeof(kContractBytes);\n\n}  // namespace strata::server::web\n")
