// What a mark of a front is about, in the line below it: for pointers, keys and fingers.
document.addEventListener("DOMContentLoaded", () => {
  for (const front of document.querySelectorAll(".front")) {
    const note = front.querySelector(".front-note")
    for (const mark of front.querySelectorAll("[data-about]")) {
      for (const happening of ["pointerenter", "focus", "click"]) {
        mark.addEventListener(happening, () => {
          for (const other of front.querySelectorAll(".chosen")) other.classList.remove("chosen")
          mark.classList.add("chosen")
          note.textContent = mark.dataset.about
        })
      }
    }
  }
})
