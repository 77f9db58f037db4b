# Writes OUT: a C++ file with the text of every FILE below FOLDER as a raw string literal, in the map NAME.
set(text "#include <map>\n#include <string>\nnamespace cohort {\nextern const std::map<std::string, std::string> ${NAME};\nconst std::map<std::string, std::string> ${NAME} = {\n")
foreach(file ${FILES})
  file(READ ${FOLDER}/${file} source)
  # A literal may hold at most 64 KiB by the standard; kernel files stay far below.
  string(APPEND text "{\"${file}\", R\"__CL__(${source})__CL__\"},\n")
endforeach()
string(APPEND text "};\n}\n")
file(WRITE ${OUT} "${text}")
